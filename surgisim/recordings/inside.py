"""Which points of a regular lattice lie inside a closed mesh.

Every column of the lattice is a ray; where it leaves the body, all points below count one more
(the winding number along the ray). A ray through an edge or a corner is decided as if it were moved
aside by (e, e^2), so no crossing is lost or counted twice.
Edelsbrunner and Muecke, Simulation of simplicity, ACM Trans. Graph. 9 (1990).
"""

import numpy as np

from surgisim.recordings.mesh import Mesh

PAIRS = 4_000_000
"""Rays times triangles looked at together: what bounds the memory."""


def winding(mesh: Mesh, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Winding number of a closed mesh at every point (x_i, y_j, z_k) [m], each ascending, (X, Y, Z) int32.

    0 outside, 1 inside a mesh that looks outwards.
    """
    steps = np.zeros((len(x), len(y), len(z) + 1), np.int32)
    corner = mesh.vertices[mesh.faces]
    low, high = corner.min(1), corner.max(1)
    i0, i1 = np.searchsorted(x, low[:, 0], "left"), np.searchsorted(x, high[:, 0], "right")
    j0, j1 = np.searchsorted(y, low[:, 1], "left"), np.searchsorted(y, high[:, 1], "right")
    pairs = (i1 - i0) * (j1 - j0)
    block = np.cumsum(pairs) // PAIRS
    for b in np.unique(block):
        chosen = np.flatnonzero((block == b) & (pairs > 0))
        face = np.repeat(chosen, pairs[chosen])
        local = np.arange(len(face)) - np.repeat(np.cumsum(pairs[chosen]) - pairs[chosen], pairs[chosen])
        wide = (j1 - j0)[face]
        i, j = i0[face] + local // wide, j0[face] + local % wide
        face, i, j, turn = _crossed(mesh, x, y, face, i, j)
        # Height of the face's plane above the ray.
        a, b_, c = np.moveaxis(mesh.vertices[mesh.faces[face]], 1, 0)
        normal = np.cross(b_ - a, c - a)
        along = normal[:, 0] * (x[i] - a[:, 0]) + normal[:, 1] * (y[j] - a[:, 1])
        # A steep face has no exact height; what is lost stays between its lowest and highest corner.
        upright = normal[:, 2] == 0
        height = a[:, 2] - np.where(upright, 0.0, along) / np.where(upright, 1.0, normal[:, 2])
        height = np.clip(height, low[face, 2], high[face, 2])
        np.add.at(steps, (i, j, np.searchsorted(z, height, "left")), turn)
    # A crossing above k points adds to each of them.
    return np.cumsum(steps[:, :, ::-1], axis=2)[:, :, ::-1][:, :, 1:]


def _crossed(mesh: Mesh, x, y, face, i, j):
    """The pairs whose ray meets the triangle, and whether it leaves (+1) or enters (-1) the body there."""
    sides = []
    for k in range(3):
        first, second = mesh.faces[face, k], mesh.faces[face, (k + 1) % 3]
        # Both triangles of an edge ask the same question in the same order, so rounding cannot divide them.
        swap = first > second
        p, q = mesh.vertices[np.where(swap, second, first)], mesh.vertices[np.where(swap, first, second)]
        d = q - p
        side = d[:, 0] * (y[j] - p[:, 1]) - d[:, 1] * (x[i] - p[:, 0])
        side = np.where(side != 0, side, np.where(d[:, 1] != 0, -d[:, 1], d[:, 0]))
        sides.append(np.sign(np.where(swap, -side, side)).astype(int))
    total = sides[0] + sides[1] + sides[2]
    hit = np.abs(total) == 3
    return face[hit], i[hit], j[hit], np.sign(total[hit])
