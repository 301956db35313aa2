"""One step of the total-Lagrangian method and its adjoint, on the device.

    F_p = I + sum_i u_i (x) dw_ip,   Fdot_p = sum_i v_i (x) dw_ip
    f_i = -sum_p V_p P(F_p, Fdot_p) dw_ip + sum_p w_ip b_p
    v_i <- v_i + dt (f_i / m_i + g),   u_i <- u_i + dt v_i             (symplectic Euler)

b_p holds anchored particles (a grip, the base) to their path by a spring per unit of mass,
so that the constraint acts on the interpolated motion of the driven volume itself and not on
whole nodes, which would widen it by up to a cell.

On a GPU both passes only gather: every node sums over its own links in a fixed order, so results do
not depend on the number of threads. On a CPU, where a launch is one thread, particles add straight
into the nodes instead: as repeatable, and without fetching every stress 27 times.

State lives in a ring of slots, (L, N): slot n % L is read and slot (n + 1) % L written, which
serves a plain run (L = 2) and a recorded segment (L = steps + 1) alike.
"""

from functools import cache
from types import SimpleNamespace

import warp as wp

from surgisim.physics.catalogue import choose
from surgisim.physics.fold import fold, gather, power


@wp.func
def kinematics(
    u: wp.array2d(dtype=wp.vec3),
    v: wp.array2d(dtype=wp.vec3),
    index: wp.array2d(dtype=int),
    link: wp.array2d(dtype=wp.vec4),
    slot: int,
    p: int,
):
    # Nine numbers each rather than matrices: the CPU compiler keeps those in registers.
    f00, f01, f02 = float(1.0), float(0.0), float(0.0)
    f10, f11, f12 = float(0.0), float(1.0), float(0.0)
    f20, f21, f22 = float(0.0), float(0.0), float(1.0)
    d00, d01, d02 = float(0.0), float(0.0), float(0.0)
    d10, d11, d12 = float(0.0), float(0.0), float(0.0)
    d20, d21, d22 = float(0.0), float(0.0), float(0.0)
    for k in range(index.shape[1]):
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
    F = wp.mat33(f00, f01, f02, f10, f11, f12, f20, f21, f22)
    Fdot = wp.mat33(d00, d01, d02, d10, d11, d12, d20, d21, d22)
    return F, Fdot


@wp.func
def carried(
    u: wp.array2d(dtype=wp.vec3),
    index: wp.array2d(dtype=int),
    link: wp.array2d(dtype=wp.vec4),
    slot: int,
    p: int,
):
    total = wp.vec3()
    for k in range(index.shape[1]):
        total += link[p, k][0] * u[slot, index[p, k]]
    return total


@wp.struct
class Anchors:
    """Which particles are held to which path, and how stiffly."""

    member: wp.array(dtype=int)
    path: wp.array2d(dtype=wp.vec3)
    active: wp.array2d(dtype=int)
    stiffness: wp.array(dtype=float)


@wp.kernel(enable_backward=False)
def node_gather(
    start: wp.array(dtype=int),
    entry: wp.array(dtype=int),
    link: wp.array2d(dtype=wp.vec4),
    stress: wp.array(dtype=wp.mat33),
    push: wp.array(dtype=wp.vec3),
    force: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    total = wp.vec3()
    for e in range(start[i], start[i + 1]):
        p = entry[e] / link.shape[1]
        w = link[p, entry[e] - p * link.shape[1]]
        total += w[0] * push[p] - stress[p] * wp.vec3(w[1], w[2], w[3])
    force[i] = total


@wp.kernel(enable_backward=False)
def node_step(
    clock: wp.array(dtype=int),
    mass: wp.array(dtype=float),
    gravity: wp.vec3,
    dt: float,
    slots: int,
    force: wp.array(dtype=wp.vec3),
    u: wp.array2d(dtype=wp.vec3),
    v: wp.array2d(dtype=wp.vec3),
):
    i = wp.tid()
    n = clock[0]
    here = n % slots
    there = (n + 1) % slots
    speed = v[here, i] + dt * (force[i] / mass[i] + gravity)
    v[there, i] = speed
    u[there, i] = u[here, i] + dt * speed
    force[i] = wp.vec3()


@wp.kernel(enable_backward=False)
def tick(clock: wp.array(dtype=int), by: int):
    clock[0] = clock[0] + by
    clock[1] = clock[1] + by


@wp.kernel(enable_backward=False)
def node_adjoint_before(
    mass: wp.array(dtype=float),
    dt: float,
    u_bar: wp.array(dtype=wp.vec3),
    v_bar: wp.array(dtype=wp.vec3),
    f_bar: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    total = v_bar[i] + dt * u_bar[i]
    v_bar[i] = total
    f_bar[i] = (dt / mass[i]) * total


@wp.kernel(enable_backward=False)
def node_adjoint_gather(
    start: wp.array(dtype=int),
    entry: wp.array(dtype=int),
    link: wp.array2d(dtype=wp.vec4),
    F_bar: wp.array(dtype=wp.mat33),
    Fdot_bar: wp.array(dtype=wp.mat33),
    x_bar: wp.array(dtype=wp.vec3),
    u_bar: wp.array(dtype=wp.vec3),
    v_bar: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    du = wp.vec3()
    dv = wp.vec3()
    for e in range(start[i], start[i + 1]):
        p = entry[e] / link.shape[1]
        w = link[p, entry[e] - p * link.shape[1]]
        g = wp.vec3(w[1], w[2], w[3])
        du += F_bar[p] * g + w[0] * x_bar[p]
        dv += Fdot_bar[p] * g
    u_bar[i] = u_bar[i] + du
    v_bar[i] = v_bar[i] + dv


@cache
def particle_kernels(names: tuple[str, ...], scatter: bool) -> SimpleNamespace:
    """`step` and `adjoint` over particles, compiled for these laws; `scatter` into nodes, or leave that to a gather."""
    terms = choose(names, "the laws of a simulation")
    columns = sum(len(t.params) for t in terms.values())
    total, read, work = fold(terms), gather(columns), power(terms)

    @wp.kernel(module="unique", enable_backward=False)
    def step(
        clock: wp.array(dtype=int),
        index: wp.array2d(dtype=int),
        link: wp.array2d(dtype=wp.vec4),
        volume: wp.array(dtype=float),
        weight: wp.array(dtype=float),
        theta: wp.array2d(dtype=float),
        anchors: Anchors,
        slots: int,
        u: wp.array2d(dtype=wp.vec3),
        v: wp.array2d(dtype=wp.vec3),
        stress: wp.array(dtype=wp.mat33),
        push: wp.array(dtype=wp.vec3),
        force: wp.array(dtype=wp.vec3),
        trouble: wp.array(dtype=int),
    ):
        p = wp.tid()
        slot = clock[0] % slots
        F, Fdot = kinematics(u, v, index, link, slot, p)
        J = wp.determinant(F)
        # Written so that a NaN is trouble too.
        if not (J > 0.0):
            wp.atomic_min(trouble, 0, clock[1])
            trouble[1] = p
        inverse = wp.inverse(F)
        L = Fdot * inverse
        D = 0.5 * (L + wp.transpose(L))
        piola = (volume[p] * J) * total(F, D, read(theta, p)) * wp.transpose(inverse)
        held = anchors.member[p]
        pull = wp.vec3()
        if held > 0:
            n = clock[1]
            x = wp.vec3()
            located = int(0)
            for a in range(anchors.path.shape[0]):
                if ((held >> a) & 1) == 1 and anchors.active[a, n] == 1:
                    if located == 0:
                        x = carried(u, index, link, slot, p)
                        located = 1
                    pull += (weight[p] * anchors.stiffness[a]) * (anchors.path[a, n] - x)
        if wp.static(scatter):
            for k in range(index.shape[1]):
                w = link[p, k]
                wp.atomic_add(force, index[p, k], w[0] * pull - piola * wp.vec3(w[1], w[2], w[3]))
        else:
            stress[p] = piola
            push[p] = pull

    @wp.kernel(module="unique", enable_backward=False)
    def adjoint(
        clock: wp.array(dtype=int),
        index: wp.array2d(dtype=int),
        link: wp.array2d(dtype=wp.vec4),
        volume: wp.array(dtype=float),
        weight: wp.array(dtype=float),
        theta: wp.array2d(dtype=float),
        anchors: Anchors,
        slots: int,
        u: wp.array2d(dtype=wp.vec3),
        v: wp.array2d(dtype=wp.vec3),
        f_bar: wp.array(dtype=wp.vec3),
        F_bar: wp.array(dtype=wp.mat33),
        Fdot_bar: wp.array(dtype=wp.mat33),
        x_bar: wp.array(dtype=wp.vec3),
        u_bar: wp.array(dtype=wp.vec3),
        v_bar: wp.array(dtype=wp.vec3),
        theta_bar: wp.array2d(dtype=float),
    ):
        p = wp.tid()
        slot = clock[0] % slots
        F, Fdot = kinematics(u, v, index, link, slot, p)
        A = wp.mat33()
        b = wp.vec3()
        for k in range(index.shape[1]):
            w = link[p, k]
            f = f_bar[index[p, k]]
            A -= wp.outer(f, wp.vec3(w[1], w[2], w[3]))
            b += w[0] * f
        mine = read(theta, p)
        dF, dFdot, dtheta, _dA = wp.grad(work)(F, Fdot, mine, volume[p] * A)
        for m in range(wp.static(columns)):
            theta_bar[p, m] = theta_bar[p, m] + dtheta[m]
        held = anchors.member[p]
        spring = float(0.0)
        if held > 0:
            for a in range(anchors.path.shape[0]):
                if ((held >> a) & 1) == 1 and anchors.active[a, clock[1]] == 1:
                    spring += weight[p] * anchors.stiffness[a]
        dx = (-spring) * b
        if wp.static(scatter):
            for k in range(index.shape[1]):
                w = link[p, k]
                g = wp.vec3(w[1], w[2], w[3])
                wp.atomic_add(u_bar, index[p, k], dF * g + w[0] * dx)
                wp.atomic_add(v_bar, index[p, k], dFdot * g)
        else:
            F_bar[p] = dF
            Fdot_bar[p] = dFdot
            x_bar[p] = dx

    return SimpleNamespace(step=step, adjoint=adjoint, columns=columns)
