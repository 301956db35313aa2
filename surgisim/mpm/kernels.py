"""One step of the total-Lagrangian method and its adjoint, on the device.

    F_p = I + sum_i u_i (x) dw_ip,   Fdot_p = sum_i v_i (x) dw_ip
    f_i = sum_p V_p (w_ip (b_p + h_p) - P(F_p, Fdot_p, q_p) dw_ip)
    v_i <- v_i + dt (f_i / m_i + g),   u_i <- u_i + dt v_i             (symplectic Euler)

q_p is what the laws remember, b_p their forces, and h_p the springs that hold anchored particles (a grip,
the base) to their path, so that the constraint acts on the interpolated motion of the driven volume itself and
not on whole nodes, which would widen it by up to a cell.

On a GPU both passes only gather, in a fixed order, so results do not depend on the number of threads: particles that
hang on the same nodes (those of one cell) are lumped first, one sum for each of their nodes, and every node sums over
its lumps. On a CPU, where a launch is one thread, particles add straight into the nodes instead: as repeatable, and
without storing a stress; each of several threads has a share of the particles and its own part of the sums.

State lives in a ring of slots, (L, N): slot n % L is read and slot (n + 1) % L written, which
serves a plain run (L = 2) and a recorded segment (L = steps + 1) alike.
"""

from functools import cache
from types import SimpleNamespace

import warp as wp

from surgisim.physics.fold import REAL, folded

ABREAST = 4
"""Links that a GPU's thread fetches at once, rather than wait for one after the other; rows hold a multiple of it."""


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
        begin: wp.array(dtype=int),
        link: wp.array2d(dtype=Link),
        stress: wp.array(dtype=Mat),
        push: wp.array(dtype=Vec),
        stride: int,
        lumped: wp.array(dtype=Vec),
    ):
        c, k = wp.tid()
        total = Vec()
        for p in range(begin[c], begin[c + 1]):
            w = link[p, k]
            total += w[0] * push[p] - stress[p] * Vec(w[1], w[2], w[3])
        lumped[c * stride + k] = total

    @wp.kernel(module="unique", enable_backward=False)
    def gather(
        start: wp.array(dtype=int),
        entry: wp.array(dtype=int),
        lumped: wp.array(dtype=Vec),
        force: wp.array2d(dtype=Vec),
    ):
        i = wp.tid()
        total = Vec()
        for e in range(start[i], start[i + 1]):
            total += lumped[entry[e]]
        force[0, i] = total

    @wp.kernel(module="unique", enable_backward=False)
    def step(
        clock: wp.array(dtype=int),
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
        n = clock[0]
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
        lumped_u: wp.array(dtype=Vec),
        lumped_v: wp.array(dtype=Vec),
        u_bar: wp.array2d(dtype=Vec),
        v_bar: wp.array2d(dtype=Vec),
    ):
        i = wp.tid()
        du = Vec()
        dv = Vec()
        for e in range(start[i], start[i + 1]):
            du += lumped_u[entry[e]]
            dv += lumped_v[entry[e]]
        u_bar[0, i] = u_bar[0, i] + du
        v_bar[0, i] = v_bar[0, i] + dv

    return SimpleNamespace(
        lump=lump, gather=gather, step=step, before=before, lump_back=lump_back, gather_back=gather_back
    )


@cache
def particle_kernels(names: tuple[str, ...], scatter: bool, precision: str = "single") -> SimpleNamespace:
    """`step` and `adjoint` over particles, compiled for these laws; `scatter` into nodes, or leave that to a gather."""
    laws, s = folded(names, precision), shapes(precision)
    real, Vec, Mat, Link, Anchors = s.real, s.Vec, s.Mat, s.Link, s.Anchors
    Theta, Memory, respond, work = laws.Theta, laws.Memory, laws.respond, laws.work
    AT_ONCE = 1 if scatter else ABREAST

    @wp.func
    def kinematics(
        u: wp.array2d(dtype=Vec),
        v: wp.array2d(dtype=Vec),
        index: wp.array2d(dtype=int),
        link: wp.array2d(dtype=Link),
        slot: int,
        p: int,
    ):
        # Nine numbers each rather than matrices: the CPU compiler keeps those in registers.
        f00, f01, f02 = real(1.0), real(0.0), real(0.0)
        f10, f11, f12 = real(0.0), real(1.0), real(0.0)
        f20, f21, f22 = real(0.0), real(0.0), real(1.0)
        d00, d01, d02 = real(0.0), real(0.0), real(0.0)
        d10, d11, d12 = real(0.0), real(0.0), real(0.0)
        d20, d21, d22 = real(0.0), real(0.0), real(0.0)
        for block in range(index.shape[1] / wp.static(AT_ONCE)):
            for j in range(wp.static(AT_ONCE)):
                k = block * wp.static(AT_ONCE) + j
                i = index[p, k]
                w = link[p, k]
                a = u[slot, i]
                b = v[slot, i]
                f00 += a[0] * w[1]
                f01 += a[0] * w[2]
                f02 += a[0] * w[3]
                f10 += a[1] * w[1]
                f11 += a[1] * w[2]
                f12 += a[1] * w[3]
                f20 += a[2] * w[1]
                f21 += a[2] * w[2]
                f22 += a[2] * w[3]
                d00 += b[0] * w[1]
                d01 += b[0] * w[2]
                d02 += b[0] * w[3]
                d10 += b[1] * w[1]
                d11 += b[1] * w[2]
                d12 += b[1] * w[3]
                d20 += b[2] * w[1]
                d21 += b[2] * w[2]
                d22 += b[2] * w[3]
        F = Mat(f00, f01, f02, f10, f11, f12, f20, f21, f22)
        Fdot = Mat(d00, d01, d02, d10, d11, d12, d20, d21, d22)
        return F, Fdot

    @wp.func
    def kinematics_and_forces(
        u: wp.array2d(dtype=Vec),
        v: wp.array2d(dtype=Vec),
        f_bar: wp.array(dtype=Vec),
        index: wp.array2d(dtype=int),
        link: wp.array2d(dtype=Link),
        slot: int,
        p: int,
    ):
        f00, f01, f02 = real(1.0), real(0.0), real(0.0)
        f10, f11, f12 = real(0.0), real(1.0), real(0.0)
        f20, f21, f22 = real(0.0), real(0.0), real(1.0)
        d00, d01, d02 = real(0.0), real(0.0), real(0.0)
        d10, d11, d12 = real(0.0), real(0.0), real(0.0)
        d20, d21, d22 = real(0.0), real(0.0), real(0.0)
        a00, a01, a02 = real(0.0), real(0.0), real(0.0)
        a10, a11, a12 = real(0.0), real(0.0), real(0.0)
        a20, a21, a22 = real(0.0), real(0.0), real(0.0)
        g0, g1, g2 = real(0.0), real(0.0), real(0.0)
        for block in range(index.shape[1] / wp.static(AT_ONCE)):
            for j in range(wp.static(AT_ONCE)):
                k = block * wp.static(AT_ONCE) + j
                i = index[p, k]
                w = link[p, k]
                a = u[slot, i]
                b = v[slot, i]
                f = f_bar[i]
                f00 += a[0] * w[1]
                f01 += a[0] * w[2]
                f02 += a[0] * w[3]
                f10 += a[1] * w[1]
                f11 += a[1] * w[2]
                f12 += a[1] * w[3]
                f20 += a[2] * w[1]
                f21 += a[2] * w[2]
                f22 += a[2] * w[3]
                d00 += b[0] * w[1]
                d01 += b[0] * w[2]
                d02 += b[0] * w[3]
                d10 += b[1] * w[1]
                d11 += b[1] * w[2]
                d12 += b[1] * w[3]
                d20 += b[2] * w[1]
                d21 += b[2] * w[2]
                d22 += b[2] * w[3]
                a00 -= f[0] * w[1]
                a01 -= f[0] * w[2]
                a02 -= f[0] * w[3]
                a10 -= f[1] * w[1]
                a11 -= f[1] * w[2]
                a12 -= f[1] * w[3]
                a20 -= f[2] * w[1]
                a21 -= f[2] * w[2]
                a22 -= f[2] * w[3]
                g0 += f[0] * w[0]
                g1 += f[1] * w[0]
                g2 += f[2] * w[0]
        F = Mat(f00, f01, f02, f10, f11, f12, f20, f21, f22)
        Fdot = Mat(d00, d01, d02, d10, d11, d12, d20, d21, d22)
        A = Mat(a00, a01, a02, a10, a11, a12, a20, a21, a22)
        return F, Fdot, A, Vec(g0, g1, g2)

    @wp.func
    def carried(
        field: wp.array2d(dtype=Vec), index: wp.array2d(dtype=int), link: wp.array2d(dtype=Link), slot: int, p: int
    ):
        total = Vec()
        for k in range(index.shape[1]):
            total += link[p, k][0] * field[slot, index[p, k]]
        return total

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

    @wp.kernel(module="unique", enable_backward=False)
    def step(
        clock: wp.array(dtype=int),
        index: wp.array2d(dtype=int),
        link: wp.array2d(dtype=Link),
        volume: wp.array(dtype=real),
        rho: wp.array(dtype=real),
        rest: wp.array(dtype=Vec),
        theta: wp.array2d(dtype=real),
        anchors: Anchors,
        dt: real,
        slots: int,
        part: int,
        begin: int,
        u: wp.array2d(dtype=Vec),
        v: wp.array2d(dtype=Vec),
        q: wp.array2d(dtype=Memory),
        stress: wp.array(dtype=Mat),
        push: wp.array(dtype=Vec),
        force: wp.array2d(dtype=Vec),
        trouble: wp.array2d(dtype=int),
    ):
        p = begin + wp.tid()
        n = clock[1]
        slot = clock[0] % slots
        F, Fdot = kinematics(u, v, index, link, slot, p)
        J = wp.determinant(F)
        # Written so that a NaN is trouble too.
        if not (real(0.0) < J):
            wp.atomic_min(trouble, part, 0, n)
            trouble[part, 1] = p
        held = anchors.member[p]
        x = Vec()
        y = Vec()
        if wp.static(laws.forces):
            x = carried(u, index, link, slot, p)
            y = carried(v, index, link, slot, p)
        elif held > 0:
            x = carried(u, index, link, slot, p)
        before = Memory()
        if wp.static(laws.memory > 0):
            before = q[slot, p]
        P, b, after = respond(F, Fdot, x, y, before, read(theta, p), real(n) * dt, dt, rho[p])
        if wp.static(laws.memory > 0):
            q[(clock[0] + 1) % slots, p] = after
        piola = volume[p] * P
        pull = volume[p] * b
        if held > 0:
            for a in range(anchors.path.shape[0]):
                if ((held >> a) & 1) == 1 and anchors.hold[a, n] > real(0.0):
                    away = target(anchors, rest[p], a, n) - x
                    pull += (volume[p] * anchors.share[p] * anchors.hold[a, n]) * (anchors.stiffness[a] * away)
        if wp.static(scatter):
            for k in range(index.shape[1]):
                w = link[p, k]
                wp.atomic_add(force, part, index[p, k], w[0] * pull - piola * Vec(w[1], w[2], w[3]))
        else:
            stress[p] = piola
            push[p] = pull

    @wp.kernel(module="unique", enable_backward=False)
    def adjoint(
        clock: wp.array(dtype=int),
        index: wp.array2d(dtype=int),
        link: wp.array2d(dtype=Link),
        volume: wp.array(dtype=real),
        rho: wp.array(dtype=real),
        rest: wp.array(dtype=Vec),
        theta: wp.array2d(dtype=real),
        anchors: Anchors,
        dt: real,
        slots: int,
        part: int,
        begin: int,
        u: wp.array2d(dtype=Vec),
        v: wp.array2d(dtype=Vec),
        q: wp.array2d(dtype=Memory),
        f_bar: wp.array(dtype=Vec),
        F_bar: wp.array(dtype=Mat),
        Fdot_bar: wp.array(dtype=Mat),
        x_bar: wp.array(dtype=Vec),
        y_bar: wp.array(dtype=Vec),
        u_bar: wp.array2d(dtype=Vec),
        v_bar: wp.array2d(dtype=Vec),
        q_bar: wp.array(dtype=Memory),
        theta_bar: wp.array2d(dtype=real),
        rho_bar: wp.array(dtype=real),
        path_bar: wp.array3d(dtype=Vec),
        hold_bar: wp.array3d(dtype=real),
        stiffness_bar: wp.array2d(dtype=Mat),
    ):
        p = begin + wp.tid()
        n = clock[1]
        slot = clock[0] % slots
        F, Fdot, A, b = kinematics_and_forces(u, v, f_bar, index, link, slot, p)
        held = anchors.member[p]
        x = Vec()
        y = Vec()
        if wp.static(laws.forces):
            x = carried(u, index, link, slot, p)
            y = carried(v, index, link, slot, p)
        elif held > 0 and stiffness_bar.shape[1] > 0:
            x = carried(u, index, link, slot, p)
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
        if wp.static(scatter):
            for k in range(index.shape[1]):
                w = link[p, k]
                g = Vec(w[1], w[2], w[3])
                wp.atomic_add(u_bar, part, index[p, k], dF * g + w[0] * dx)
                if wp.static(laws.forces):
                    wp.atomic_add(v_bar, part, index[p, k], dFdot * g + w[0] * dy)
                else:
                    wp.atomic_add(v_bar, part, index[p, k], dFdot * g)
        else:
            F_bar[p] = dF
            Fdot_bar[p] = dFdot
            x_bar[p] = dx
            y_bar[p] = dy

    return SimpleNamespace(step=step, adjoint=adjoint, columns=laws.columns, memory=laws.memory, laws=laws)
