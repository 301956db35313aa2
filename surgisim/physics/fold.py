"""Many laws, one device function: stresses add, parameters lie side by side in theta's columns."""

from typing import Any

import warp as wp

from surgisim.physics.catalogue import Term


def gather(count: int) -> Any:
    """`wp.func (theta (P, M), p) -> vector of M`: one particle's parameters."""
    Theta = wp.types.vector(count, float)

    @wp.func
    def read(theta: wp.array2d(dtype=float), p: int):
        mine = Theta()
        for i in range(wp.static(count)):
            mine[i] = theta[p, i]
        return mine

    return read


def power(terms: dict[str, Term]) -> Any:
    """`wp.func (F, Fdot, theta vector, A) -> A : P`, P the first Piola stress [Pa].

    Its gradient with respect to F, Fdot and theta is the stress's adjoint applied to A, which is
    all that a backward step needs of the laws.
    """
    columns = sum(len(t.params) for t in terms.values())
    Theta = wp.types.vector(columns, float)
    total = fold(terms)

    @wp.func
    def power(F: wp.mat33, Fdot: wp.mat33, theta: Theta, A: wp.mat33):
        inverse = wp.inverse(F)
        L = Fdot * inverse
        D = 0.5 * (L + wp.transpose(L))
        P = wp.determinant(F) * total(F, D, theta) * wp.transpose(inverse)
        return wp.ddot(A, P)

    return power


def fold(terms: dict[str, Term]) -> Any:
    """`wp.func (F, D, theta) -> summed Cauchy stress [Pa]`, theta one particle's parameters."""
    columns = sum(len(t.params) for t in terms.values())
    column, total = 0, None
    for term in terms.values():
        mine = _slice(term.stress, len(term.params), column, columns)
        column += len(term.params)
        total = mine if total is None else _sum(total, mine, columns)
    return total


def _slice(stress, count, column, columns):
    Mine = wp.types.vector(count, float)
    Theta = wp.types.vector(columns, float)

    @wp.func
    def part(F: wp.mat33, D: wp.mat33, theta: Theta):
        mine = Mine()
        for i in range(wp.static(count)):
            mine[i] = theta[wp.static(column) + i]
        return stress(F, D, mine)

    return part


def _sum(first, second, columns):
    Theta = wp.types.vector(columns, float)

    @wp.func
    def both(F: wp.mat33, D: wp.mat33, theta: Theta):
        return first(F, D, theta) + second(F, D, theta)

    return both
