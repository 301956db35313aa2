"""Nodes with hardly any tissue follow the nodes inside, along straight lines.

    u_i = 2 u_j - u_k,   j and k the next two nodes inward

Nodes further out than the next to a solid one follow their neighbour instead, u_i = u_j: only splats
far from the body lean on them, and a straight line drawn on for several cells flies away.

A B-spline whose support touches the body only at its rim has so little mass and stiffness that it
drifts on its own; the extrapolated one is stable and still reproduces every linear field exactly.
Hoellig, Reif and Wipper, Weighted extended B-spline approximation of Dirichlet problems, SIAM J.
Numer. Anal. 39 (2001).
"""

from functools import lru_cache

import numpy as np
from scipy import sparse
from scipy.ndimage import binary_dilation

from surgisim.mpm.grid import Grid
from surgisim.mpm.tear import Severing

SOLID = 0.02
"""Share of the largest nodal mass above which a node moves by itself."""
LEAST = 0.01
"""Share that must be left to it once others hang on it; a lighter one would ask for tiny steps."""
PASSES = 4
"""Rings of nodes around the body that are carried along."""


def extension(grid: Grid, mass: np.ndarray, cut: Severing | None) -> tuple[np.ndarray, sparse.csr_matrix]:
    """Solid nodes (A,), and the rule for every node from them, (N or 2 N, A); rows of unreached nodes are zero.

    mass [kg], (N,), or (2 N,) once cut: the second half are the copies seen from across the cut.
    """
    solid = mass > SOLID * mass.max()
    while True:
        place, rule = _followed(grid, solid, cut) if cut else _of_whole(tuple(grid.shape.tolist()), solid.tobytes())
        light = rule.T @ mass < LEAST * mass.max()
        if not light.any():
            return place, rule
        solid[place[light]] = False


@lru_cache(maxsize=16)
def _of_whole(shape: tuple[int, int, int], solid: bytes) -> tuple[np.ndarray, sparse.csr_matrix]:
    """Kept: bodies that are laid a little deeper, or gripped beside, mostly have the same nodes. Not to be changed."""
    return _followed(Grid(np.zeros(3), np.array(shape), 1.0), np.frombuffer(solid, bool), None)


def _followed(grid: Grid, solid: np.ndarray, cut: Severing | None) -> tuple[np.ndarray, sparse.csr_matrix]:
    place = np.flatnonzero(solid)
    size = len(solid)
    rule = sparse.csr_matrix((np.ones(len(place)), (place, np.arange(len(place)))), (size, len(place)))
    known = solid.copy()
    touched = solid.reshape(-1, *grid.shape).any(0)
    near = np.tile(binary_dilation(touched, np.ones((3, 3, 3))).ravel(), size // grid.count)
    hops = [_neighbours(grid, size, axis, sign, cut) for axis in range(3) for sign in (1, -1)]
    for _ in range(PASSES):
        total = sparse.csr_matrix(rule.shape)
        votes = np.zeros(size)
        # Straight lines first; a body one node thick has none, and is followed as a whole.
        for straight in (True, False):
            for first in hops:
                second = np.where(first >= 0, first[first], -1)
                usable = ~known & (first >= 0) & (votes == 0 if not straight else True)
                usable &= known[first] & (near & (second >= 0) & known[second] if straight else True)
                rows = np.flatnonzero(usable)
                if not len(rows):
                    continue
                value = 2 * rule[first[rows]] - rule[second[rows]] if straight else rule[first[rows]]
                lift = sparse.csr_matrix((np.ones(len(rows)), (rows, np.arange(len(rows)))), (size, len(rows)))
                total = total + lift @ value
                if straight:
                    votes[rows] += 1
                else:
                    votes[rows] -= 1
        count = np.abs(votes)
        rule = rule + sparse.diags(np.where(count > 0, 1 / np.maximum(count, 1), 0.0)) @ total
        known = known | (count > 0)
    return place, rule.tocsr()


def _neighbours(grid: Grid, size: int, axis: int, sign: int, cut: Severing | None) -> np.ndarray:
    """Next node along an axis, -1 where there is none or the cut lies between, (size,)."""
    n = grid.count
    index = np.stack(np.unravel_index(np.arange(n), grid.shape), -1)
    index[:, axis] += sign
    inside = (index[:, axis] >= 0) & (index[:, axis] < grid.shape[axis])
    index[:, axis] = np.clip(index[:, axis], 0, grid.shape[axis] - 1)
    target = np.ravel_multi_index(tuple(index.T), tuple(grid.shape))
    hop = np.where(inside, target, -1)
    if size == n:
        return hop
    at = grid.positions()
    across = inside & cut.crosses(at, at[target])
    # A copy belongs to tissue on the far side: stepping back across the cut leads to that tissue's own nodes.
    own = np.where(across, -1, hop)
    copy = np.where(hop < 0, -1, np.where(across, hop, hop + n))
    return np.concatenate([own, copy])
