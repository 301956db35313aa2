"""Many laws, one device function: stresses add, factors multiply, parameters and memories lie side by side."""

from functools import cache
from types import SimpleNamespace
from typing import Any

import warp as wp

from surgisim.physics.catalogue import choose, defaults
from surgisim.physics.rotation import rotation

REAL = {"single": wp.float32, "double": wp.float64}


@cache
def folded(names: tuple[str, ...], precision: str = "single") -> SimpleNamespace:
    """The laws as one: `respond`, `work`, their vector types, and how wide theta and memory are.

    respond: `(F, Fdot, u, v, q, theta, t, dt, rho) -> first Piola stress [Pa], force [N/m^3], memory after the step`.
    work: `(..., A, b, Q) -> A : P + b . f + Q . q'`. Its gradient is the adjoint of all three at once, which is all
    that a backward step needs of the laws.
    """
    terms, real = choose(names, "the laws of a simulation"), REAL[precision]
    widths = [len(t.row(defaults(t))) for t in terms.values()]
    columns, memory = sum(widths), sum(t.memory for t in terms.values())
    Mat, Vec = wp.types.matrix((3, 3), real), wp.types.vector(3, real)
    Theta, Memory = wp.types.vector(max(1, columns), real), wp.types.vector(max(1, memory), real)
    elastic, other, balanced, factors, flows, forces, steps = [], [], [], [], [], [], []
    column = cell = 0
    for term, width in zip(terms.values(), widths, strict=True):
        mine = _slice(column, width, Theta, real)
        own = _slice(cell, term.memory, Memory, real)
        column, cell = column + width, cell + term.memory
        if term.stress is not None:
            kind = balanced if term.balanced else elastic if term.energy is not None else other
            kind.append(_stress(term, mine, own))
        if term.factor is not None:
            factors.append(_factor(term.factor, mine, own))
        if term.flow is not None:
            flows.append(_flow(term.flow, mine, own))
        if term.force is not None:
            forces.append(_force(term.force, mine, own))
        if term.advance is not None:
            steps.append(_advance(term.advance, mine, own, cell - term.memory, term.memory, Memory))
    energies, losses, held = (_chain(k, _no_stress, _sum) for k in (elastic, other, balanced))
    factor, flow = _chain(factors, _unit_factor, _product), _chain(flows, _no_flow, _matrix_product)
    force, step = _chain(forces, _no_force, _force_sum), _chain(steps, _no_step, _in_turn)
    turns = any(t.wide for t in terms.values()) or bool(steps)

    @wp.func
    def respond(F: Mat, Fdot: Mat, u: Vec, v: Vec, q: Memory, theta: Theta, t: real, dt: real, rho: real):
        inverse = wp.inverse(F)
        L = Fdot * inverse
        D = real(0.5) * (L + wp.transpose(L))
        J = wp.determinant(F)
        R = F
        if wp.static(turns):
            R = rotation(F)
        after = step(F, D, R, u, q, q, theta, dt)
        sigma = losses(F, D, R, after, theta, t)
        if wp.static(bool(flows)):
            G = flow(after, theta)
            sigma += factor(F, after, theta) * energies(F * G, D, R, after, theta, t)
        else:
            sigma += factor(F, after, theta) * energies(F, D, R, after, theta, t)
        P = J * sigma * wp.transpose(inverse)
        if wp.static(bool(balanced)):
            one = wp.identity(n=3, dtype=real)
            P += J * held(F, D, R, after, theta, t) * wp.transpose(inverse)
            P -= held(one, D - D, one, after, theta, t)
        return P, force(u, v, after, rho, theta, t), after

    @wp.func
    def work(
        F: Mat, Fdot: Mat, u: Vec, v: Vec, q: Memory, theta: Theta, t: real, dt: real, rho: real,
        A: Mat, b: Vec, Q: Memory,
    ):  # fmt: skip
        P, f, after = respond(F, Fdot, u, v, q, theta, t, dt, rho)
        return wp.ddot(A, P) + wp.dot(b, f) + wp.dot(Q, after)

    return SimpleNamespace(
        respond=respond, work=work, real=real, Mat=Mat, Vec=Vec, Theta=Theta, Memory=Memory, columns=columns,
        memory=memory, forces=bool(forces) or any("u" in t.advance.input_types for t in terms.values() if t.advance),
        mass=[n for n, t in terms.items() if t.mass],
    )  # fmt: skip


def _slice(start, count, Whole, real):
    """`wp.func (whole vector) -> count numbers from start`."""
    Part = wp.types.vector(max(1, count), real)

    @wp.func
    def part(whole: Whole):
        mine = Part()
        for i in range(wp.static(count)):
            mine[i] = whole[wp.static(start) + i]
        return mine

    return part


def _stress(term, mine, own):
    stress = term.stress
    if term.wide:

        @wp.func
        def wide(F: Any, D: Any, R: Any, q: Any, theta: Any, t: Any):
            return stress(F, D, R, own(q), mine(theta), t)

        return wide

    @wp.func
    def narrow(F: Any, D: Any, R: Any, q: Any, theta: Any, t: Any):
        return stress(F, D, mine(theta))

    return narrow


def _factor(factor, mine, own):
    @wp.func
    def one(F: Any, q: Any, theta: Any):
        return factor(F, own(q), mine(theta))

    return one


def _flow(flow, mine, own):
    @wp.func
    def one(q: Any, theta: Any):
        return flow(own(q), mine(theta))

    return one


def _force(force, mine, own):
    @wp.func
    def one(u: Any, v: Any, q: Any, rho: Any, theta: Any, t: Any):
        return force(u, v, own(q), rho, mine(theta), t)

    return one


def _advance(advance, mine, own, start, count, Memory):
    # A new vector, filled: the adjoint of writing into a copy of `after` counts what was there before twice.
    total = Memory._length_

    @wp.func
    def one(F: Any, D: Any, R: Any, u: Any, q: Any, after: Any, theta: Any, dt: Any):
        new = advance(F, D, R, u, own(q), mine(theta), dt)
        whole = Memory()
        for i in range(wp.static(start)):
            whole[i] = after[i]
        for i in range(wp.static(count)):
            whole[wp.static(start) + i] = new[i]
        for i in range(wp.static(start + count), wp.static(total)):
            whole[i] = after[i]
        return whole

    return one


@wp.func
def _no_stress(F: Any, D: Any, R: Any, q: Any, theta: Any, t: Any):
    return F - F


@wp.func
def _unit_factor(F: Any, q: Any, theta: Any):
    return F.dtype(1.0)


@wp.func
def _no_flow(q: Any, theta: Any):
    return wp.identity(n=3, dtype=q.dtype)


@wp.func
def _no_force(u: Any, v: Any, q: Any, rho: Any, theta: Any, t: Any):
    return u - u


@wp.func
def _no_step(F: Any, D: Any, R: Any, u: Any, q: Any, after: Any, theta: Any, dt: Any):
    return after


def _chain(parts, none, join):
    """All of one kind as one function; `none` where there is none."""
    if not parts:
        return none
    total = parts[0]
    for part in parts[1:]:
        total = join(total, part)
    return total


def _sum(first, second):
    @wp.func
    def both(F: Any, D: Any, R: Any, q: Any, theta: Any, t: Any):
        return first(F, D, R, q, theta, t) + second(F, D, R, q, theta, t)

    return both


def _product(first, second):
    @wp.func
    def both(F: Any, q: Any, theta: Any):
        return first(F, q, theta) * second(F, q, theta)

    return both


def _matrix_product(first, second):
    @wp.func
    def both(q: Any, theta: Any):
        return first(q, theta) * second(q, theta)

    return both


def _force_sum(first, second):
    @wp.func
    def both(u: Any, v: Any, q: Any, rho: Any, theta: Any, t: Any):
        return first(u, v, q, rho, theta, t) + second(u, v, q, rho, theta, t)

    return both


def _in_turn(first, second):
    @wp.func
    def both(F: Any, D: Any, R: Any, u: Any, q: Any, after: Any, theta: Any, dt: Any):
        return second(F, D, R, u, q, first(F, D, R, u, q, after, theta, dt), theta, dt)

    return both
