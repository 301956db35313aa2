"""Hexahedra that fit two gripped balls: every ball is a block of the lattice blown up to a ball, as an O-grid.

The phantom moves single nodes onto one sphere, which serves a film; here elements must stay good under
refinement. Index shells around a grip (max |di|, |dj|, dk = m) become spheres up to shell n, whose sphere is the
grip's, and pass over linearly into the plain lattice at shell `outer`.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from surgisim.phantom.block import Grip, Shape
from surgisim.phantom.elements import CORNERS, SLOPES
from surgisim.problem import Problem

CUBE = 0.7
"""Half edge of the cube that the innermost shells resemble, over the ball's radius."""
SQUEEZED = 0.15
"""Least share of a plain element's volume that any Gauss point of an even mesh stands for."""


@dataclass(frozen=True)
class Mesh:
    points: np.ndarray
    """Camera frame [m], (N, 3)."""
    uv: np.ndarray
    """[m], (N, 2)."""
    cells: np.ndarray
    """(M, 8), in the order of phantom.elements.CORNERS."""
    fixed: np.ndarray
    """The base, (N,) bool."""
    gripped: np.ndarray
    """In or on each grip's ball, (J, N) bool."""
    upper: np.ndarray
    """The upper side, (N,) bool."""


def mesh(shape: Shape, grips: tuple[Grip, ...], spacing: float) -> Mesh:
    """Hexahedra of about `spacing` [m] with a node at every grip's centre and its ball's skin on element faces.

    Raises Problem where a grip comes too near to the base, a side or another grip.
    """
    extent = np.append(shape.high - shape.low, shape.thickness)
    counts = np.maximum(np.rint(extent / spacing).astype(int), 2)
    index = np.stack(np.meshgrid(*[np.arange(c + 1) for c in counts], indexing="ij"), -1)
    edge = extent / counts
    flat = index * edge + np.append(shape.low, 0.0)
    gripped = []
    for g, grip in enumerate(grips):
        others = [other for o, other in enumerate(grips) if o != g]
        flat, inside = _blown_up(shape, grip, others, index, edge, counts, flat)
        gripped.append(inside.ravel())
    number = np.arange(index[..., 0].size).reshape(counts + 1)
    corner = ((CORNERS + 1) // 2).astype(int)
    cells = np.stack(
        [number[i : i + counts[0], j : j + counts[1], k : k + counts[2]].ravel() for i, j, k in corner], -1
    )
    return Mesh(
        points=shape.place(_bent(shape, flat.reshape(-1, 3))),
        uv=flat[..., :2].reshape(-1, 2),
        cells=cells,
        fixed=(index[..., 2] == counts[2]).ravel(),
        gripped=np.stack(gripped),
        upper=(index[..., 2] == 0).ravel(),
    )


def _bent(shape: Shape, flat: np.ndarray) -> np.ndarray:
    """Columns from the hilly upper side to the flat base: flat depth 0-thickness to local coordinates [m]."""
    top = -shape.relief(flat[..., :2])
    depth = top + flat[..., 2] / shape.thickness * (shape.thickness - top)
    return np.concatenate([flat[..., :2], depth[..., None]], -1)


def _blown_up(shape, grip, others, index, edge, counts, flat):
    """`flat` with the lattice around one grip bent into a ball, and which nodes are in or on it."""
    middle = np.append(np.rint((grip.uv - shape.low) / edge[:2]).astype(int), 0)
    clear = min(
        [np.abs(o.uv - grip.uv).max() * r for o in others for r in [grip.radius / (grip.radius + o.radius)]] + [1.0]
    )
    reach = min(1.7 * grip.radius, clear, 0.9 * shape.thickness)
    n = max(1, round(0.75 * grip.radius / edge.mean()))
    outer = max(n + 1, round(reach / edge.mean()))
    room = min(*middle[:2], *(counts - middle)[:2], counts[2])
    if outer > room or reach < 1.25 * grip.radius:
        raise Problem(
            f"phantom: a grip of radius {grip.radius:.4f} m at {np.round(grip.uv, 4).tolist()} m leaves its mesh "
            f"{room} elements of room and a reach of {reach:.4f} m. Move it inward, or make it smaller."
        )
    off = index - middle
    shell = np.abs(off).max(-1)
    near = (shell <= outer) & (shell > 0)
    m = shell[near][:, None]
    ray = off[near] * edge
    ray = ray / np.linalg.norm(ray, axis=-1, keepdims=True)
    skin = off[shell == n] * edge
    skin = skin / np.linalg.norm(skin, axis=-1, keepdims=True)
    # The hull of the skin's nodes gets the ball's volume: chords cut nothing off.
    radius = grip.radius * (2 / 3 * np.pi / ConvexHull(np.concatenate([skin, [[0, 0, 0]]])).volume) ** (1 / 3)
    center = np.append(grip.uv, 0.0)
    true_center = _bent(shape, center)
    length = np.full(len(ray), radius)
    for _ in range(60):  # the relief makes this a fixed point, not a formula
        length *= radius / np.linalg.norm(_bent(shape, center + length[:, None] * ray) - true_center, axis=-1)
    on_skin = center + length[:, None] * ray
    rim = np.append(shape.low, 0.0) + (middle + off[near] * outer / m) * edge
    share = (m - n) / (outer - n)
    # Inside, shells turn from cubes into spheres, so that only the outermost have flat angles.
    cube = off[near] / m * np.linalg.norm(on_skin - center, axis=-1, keepdims=True) * CUBE
    inner = center + m / n * (m / n * (on_skin - center) + (1 - m / n) * cube)
    bent = flat.copy()
    bent[near] = np.where(m <= n, inner, (1 - share) * on_skin + share * rim)
    bent[tuple(middle)] = center
    return bent, shell <= n


def even(shape: Shape, grips: tuple[Grip, ...], spacing: float) -> bool:
    """Whether the mesh of this `spacing` [m] exists, with no element squeezed or skewed enough to rule the steps."""
    try:
        block = mesh(shape, grips, spacing)
    except Problem:
        return False
    return squeezes_none(block.points, block.cells, spacing)


def squeezes_none(points: np.ndarray, cells: np.ndarray, spacing: float) -> bool:
    """Whether no element, of points [m], (N, 3), and cells, (M, 8), is so small that it rules the steps of all.

    spacing: edge that they were meant to have [m].
    """
    share = np.linalg.det(np.einsum("mai,gak->mgik", points[cells], SLOPES)) / (spacing / 2) ** 3
    return bool(share.min() > SQUEEZED)
