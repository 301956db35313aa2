"""One step of the total-Lagrangian method and its adjoint, on the device.

    F_p = I + sum_i u_i (x) dw_ip,   Fdot_p = sum_i v_i (x) dw_ip
    f_i = sum_p V_p (w_ip (b_p + h_p) - P(F_p, Fdot_p, q_p) dw_ip)
    v_i <- v_i + dt (f_i / m_i + g),   u_i <- u_i + dt v_i             (symplectic Euler)

q_p is what the laws remember, b_p their forces, and h_p the springs that hold anchored particles (a grip,
the base) to their path, so that the constraint acts on the interpolated motion of the driven volume itself and
not on whole nodes, which would widen it by up to a cell.

On a GPU both passes only gather, in a fixed order, so results do not depend on the number of threads: particles that
hang on the same nodes (those of one cell) are lumped first, one sum for each of their nodes, and every node sums over
its lumps, in several parts where it has hundreds, as the functions of a grip do. On a CPU, where a launch is one
thread, particles add straight into the nodes instead: as repeatable, and without storing a stress; each of several
threads has a share of the particles and its own part of the sums.

The clock moves on where nobody reads it: in a kernel of its own on a CPU, while particles are lumped on a GPU.

State lives in a ring of slots, (L, N): slot n % L is read and slot (n + 1) % L written, which
serves a plain run (L = 2) and a recorded segment (L = steps + 1) alike.
"""

from functools import cache
from types import SimpleNamespace

import warp as wp

from surgisim.physics.fold import REAL, folded

ABREAST = 4
"""Numbers that a thread fetches at once, rather than wait for one after the other; rows hold a multiple of it."""


@cache
def shapes(precision: str) -> SimpleNamespace:
    """Number types of a precision, and the anchors' struct made of them."""
    real = REAL[precision]
    Vec, Mat, Link = wp.types.vector(3, real), wp.types.matrix((3, 3), real), wp.types.vector(4, real)

    @wp.struct
    class Anchors:
        """Which particles are held to which path, and how stiffly."""

        member: wp.array(dtype=int)
        share: wp.array(dtype=real)
        path: wp.array2d(dtype=Vec)
        turn: wp.array2d(dtype=Mat)
        center: wp.array(dtype=Vec)
        hold: wp.array2d(dtype=real)
        stiffness: wp.array(dtype=Mat)
        turning: int

    return SimpleNamespace(real=real, Vec=Vec, Mat=Mat, Link=Link, Anchors=Anchors)


@wp.kernel(enable_backward=False)
def tick(clock: wp.array(dtype=int), by: int):
    clock[0] = clock[0] + by
    clock[1] = clock[1] + by


@cache
def node_kernels(precision: str) -> SimpleNamespace:
    """What happens at the nodes: `lump`, `gather`, `step`, and the adjoints `before`, `lump_back`, `gather_back`."""
    s = shapes(precision)
    real, Vec, Mat, Link = s.real, s.Vec, s.Mat, s.Link

    @wp.kernel(module="unique", enable_backward=False)
    def lump(
        clock: wp.array(dtype=int),
        begin: wp.array(dtype=int),
        link: wp.array2d(dtype=Link),
        stress: wp.array(dtype=Mat),
        push: wp.array(dtype=Vec),
        stride: int,
        lumped: wp.array(dtype=Vec),
    ):
        c, k = wp.tid()
        if c + k == 0:
            clock[0] = clock[0] + 1
            clock[1] = clock[1] + 1
        total = Vec()
        for p in range(begin[c], begin[c + 1]):
            w = link[p, k]
            total += w[0] * push[p] - stress[p] * Vec(w[1], w[2], w[3])
        lumped[c * stride + k] = total

    @wp.kernel(module="unique", enable_backward=False)
    def gather(
        start: wp.array(dtype=int),
        entry: wp.array(dtype=int),
        node: wp.array(dtype=int),
        part: wp.array(dtype=int),
        lumped: wp.array(dtype=Vec),
        force: wp.array2d(dtype=Vec),
    ):
        n = wp.tid()
        first = start[n]
        total = Vec()
        for block in range((start[n + 1] - first) / wp.static(ABREAST)):
            for j in range(wp.static(ABREAST)):
                total += lumped[entry[first + block * wp.static(ABREAST) + j]]
        force[part[n], node[n]] = total

    @wp.kernel(module="unique", enable_backward=False)
    def step(
        clock: wp.array(dtype=int),
        ahead: int,
        mass: wp.array(dtype=real),
        gravity: Vec,
        plain: int,
        dt: real,
        slots: int,
        force: wp.array2d(dtype=Vec),
        u: wp.array2d(dtype=Vec),
        v: wp.array2d(dtype=Vec),
    ):
        i = wp.tid()
        n = clock[0] - ahead
        here = n % slots
        there = (n + 1) % slots
        total = Vec()
        for part in range(force.shape[0]):
            total += force[part, i]
            force[part, i] = Vec()
        speed = v[here, i] + dt * (total / mass[i])
        if i < plain:
            speed += dt * gravity
        v[there, i] = speed
        u[there, i] = u[here, i] + dt * speed

    @wp.kernel(module="unique", enable_backward=False)
    def before(
        clock: wp.array(dtype=int),
        mass: wp.array(dtype=real),
        gravity: Vec,
        plain: int,
        dt: real,
        slots: int,
        v: wp.array2d(dtype=Vec),
        u_bar: wp.array2d(dtype=Vec),
        v_bar: wp.array2d(dtype=Vec),
        f_bar: wp.array(dtype=Vec),
        m_bar: wp.array(dtype=real),
    ):
        i = wp.tid()
        for part in range(1, u_bar.shape[0]):
            u_bar[0, i] = u_bar[0, i] + u_bar[part, i]
            v_bar[0, i] = v_bar[0, i] + v_bar[part, i]
            u_bar[part, i] = Vec()
            v_bar[part, i] = Vec()
        total = v_bar[0, i] + dt * u_bar[0, i]
        v_bar[0, i] = total
        f_bar[i] = (dt / mass[i]) * total
        if m_bar.shape[0] > 0:
            n = clock[0]
            gained = v[(n + 1) % slots, i] - v[n % slots, i]
            if i < plain:
                gained -= dt * gravity
            m_bar[i] = m_bar[i] - wp.dot(total, gained) / mass[i]

    @wp.kernel(module="unique", enable_backward=False)
    def lump_back(
        clock: wp.array(dtype=int),
        begin: wp.array(dtype=int),
        link: wp.array2d(dtype=Link),
        F_bar: wp.array(dtype=Mat),
        Fdot_bar: wp.array(dtype=Mat),
        x_bar: wp.array(dtype=Vec),
        y_bar: wp.array(dtype=Vec),
        stride: int,
        lumped_u: wp.array(dtype=Vec),
        lumped_v: wp.array(dtype=Vec),
    ):
        c, k = wp.tid()
        if c + k == 0:
            clock[0] = clock[0] - 1
            clock[1] = clock[1] - 1
        du = Vec()
        dv = Vec()
        for p in range(begin[c], begin[c + 1]):
            w = link[p, k]
            g = Vec(w[1], w[2], w[3])
            du += F_bar[p] * g + w[0] * x_bar[p]
            dv += Fdot_bar[p] * g + w[0] * y_bar[p]
        lumped_u[c * stride + k] = du
        lumped_v[c * stride + k] = dv

    @wp.kernel(module="unique", enable_backward=False)
    def gather_back(
        start: wp.array(dtype=int),
        entry: wp.array(dtype=int),
        node: wp.array(dtype=int),
        part: wp.array(dtype=int),
        lumped_u: wp.array(dtype=Vec),
        lumped_v: wp.array(dtype=Vec),
        u_bar: wp.array2d(dtype=Vec),
        v_bar: wp.array2d(dtype=Vec),
    ):
        n = wp.tid()
        first = start[n]
        du = Vec()
        dv = Vec()
        for block in range((start[n + 1] - first) / wp.static(ABREAST)):
            for j in range(wp.static(ABREAST)):
                e = entry[first + block * wp.static(ABREAST) + j]
                du += lumped_u[e]
                dv += lumped_v[e]
        u_bar[part[n], node[n]] = u_bar[part[n], node[n]] + du
        v_bar[part[n], node[n]] = v_bar[part[n], node[n]] + dv

    return SimpleNamespace(
        lump=lump, gather=gather, step=step, before=before, lump_back=lump_back, gather_back=gather_back
    )


@cache
def law_functions(names: tuple[str, ...], precision: str = "single") -> SimpleNamespace:
    """What the laws and the springs do at one particle: `answer`, and its adjoint `answer_back`."""
    laws, s = folded(names, precision), shapes(precision)
    real, Vec, Mat, Anchors = s.real, s.Vec, s.Mat, s.Anchors
    Theta, Memory, respond, work = laws.Theta, laws.Memory, laws.respond, laws.work

    @wp.func
    def read(theta: wp.array2d(dtype=real), p: int):
        mine = Theta()
        for i in range(wp.static(laws.columns)):
            mine[i] = theta[p, i]
        return mine

    @wp.func
    def target(anchors: Anchors, rest: Vec, a: int, n: int):
        """Displacement that anchor a wants of a particle."""
        to = anchors.path[a, n]
        if anchors.turning == 1:
            arm = rest - anchors.center[a]
            to += anchors.turn[a, n] * arm - arm
        return to

    @wp.func
    def answer(
        F: Mat,
        Fdot: Mat,
        x: Vec,
        y: Vec,
        p: int,
        n: int,
        slot: int,
        after_slot: int,
        dt: real,
        part: int,
        volume: wp.array(dtype=real),
        rho: wp.array(dtype=real),
        rest: wp.array(dtype=Vec),
        theta: wp.array2d(dtype=real),
        anchors: Anchors,
        q: wp.array2d(dtype=Memory),
        trouble: wp.array2d(dtype=int),
    ):
        """Stress and force of particle p at step n, times its volume; its memory is moved on."""
        # Written so that a NaN is trouble too.
        if not (real(0.0) < wp.determinant(F)):
            wp.atomic_min(trouble, part, 0, n)
            trouble[part, 1] = p
        before = Memory()
        if wp.static(laws.memory > 0):
            before = q[slot, p]
        P, b, after = respond(F, Fdot, x, y, before, read(theta, p), real(n) * dt, dt, rho[p])
        if wp.static(laws.memory > 0):
            q[after_slot, p] = after
        pull = volume[p] * b
        held = anchors.member[p]
        if held > 0:
            for a in range(anchors.path.shape[0]):
                if ((held >> a) & 1) == 1 and anchors.hold[a, n] > real(0.0):
                    away = target(anchors, rest[p], a, n) - x
                    pull += (volume[p] * anchors.share[p] * anchors.hold[a, n]) * (anchors.stiffness[a] * away)
        return volume[p] * P, pull

    @wp.func
    def answer_back(
        F: Mat,
        Fdot: Mat,
        x: Vec,
        y: Vec,
        A: Mat,
        b: Vec,
        p: int,
        n: int,
        slot: int,
        dt: real,
        part: int,
        volume: wp.array(dtype=real),
        rho: wp.array(dtype=real),
        rest: wp.array(dtype=Vec),
        theta: wp.array2d(dtype=real),
        anchors: Anchors,
        q: wp.array2d(dtype=Memory),
        q_bar: wp.array(dtype=Memory),
        theta_bar: wp.array2d(dtype=real),
        rho_bar: wp.array(dtype=real),
        path_bar: wp.array3d(dtype=Vec),
        hold_bar: wp.array3d(dtype=real),
        stiffness_bar: wp.array2d(dtype=Mat),
    ):
        """Derivatives by F, Fdot, x and y, given those by stress and force, A and b; the others are added up."""
        before = Memory()
        Q = Memory()
        if wp.static(laws.memory > 0):
            before = q[slot, p]
            Q = q_bar[p]
        dF, dFdot, dx, dy, dq, dtheta, _t, _dt, drho, _A, _b, _Q = wp.grad(work)(
            F, Fdot, x, y, before, read(theta, p), real(n) * dt, dt, rho[p], volume[p] * A, volume[p] * b, Q
        )
        if wp.static(laws.memory > 0):
            q_bar[p] = dq
        if rho_bar.shape[0] > 0:
            rho_bar[p] = rho_bar[p] + drho
        for m in range(wp.static(laws.columns)):
            theta_bar[p, m] = theta_bar[p, m] + dtheta[m]
        held = anchors.member[p]
        if held > 0:
            for a in range(anchors.path.shape[0]):
                if ((held >> a) & 1) == 1 and anchors.hold[a, n] > real(0.0):
                    pulled = (volume[p] * anchors.share[p] * anchors.hold[a, n]) * (
                        wp.transpose(anchors.stiffness[a]) * b
                    )
                    dx -= pulled
                    wp.atomic_add(path_bar, part, a, n, pulled)
                    if stiffness_bar.shape[1] > 0:
                        away = target(anchors, rest[p], a, n) - x
                        gain = volume[p] * anchors.share[p]
                        wp.atomic_add(hold_bar, part, a, n, gain * wp.dot(b, anchors.stiffness[a] * away))
                        wp.atomic_add(stiffness_bar, part, a, (gain * anchors.hold[a, n]) * wp.outer(b, away))
        return dF, dFdot, dx, dy

    return SimpleNamespace(answer=answer, answer_back=answer_back, laws=laws)
