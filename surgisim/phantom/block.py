"""The invented piece of tissue at rest: its shape, its mesh, and which of its nodes are driven."""

from dataclasses import dataclass

import numpy as np

from surgisim.phantom.elements import CORNERS
from surgisim.problem import Problem

CHORDS = 0.19
"""A third of the share of a ball's volume outside the hull of lattice nodes on its skin, over (spacing / radius)^2."""


@dataclass(frozen=True)
class Shape:
    """A slab whose upper side has gentle hills; local coordinates (u, v, depth), depth into the tissue."""

    center: np.ndarray
    """Camera frame [m], (3,), where u = v = depth = 0."""
    axes: np.ndarray
    """Rows u, v, depth in the camera frame, orthonormal and right-handed, (3, 3)."""
    low: np.ndarray
    """Least u, v [m], (2,)."""
    high: np.ndarray
    """Greatest u, v [m], (2,)."""
    thickness: float
    """Below the mean upper side [m]."""
    waves: np.ndarray
    """Hills: rows of wave number along u, along v [rad/m], phase [rad], height [m], (W, 4)."""

    def relief(self, uv: np.ndarray) -> np.ndarray:
        """Height of the upper side above its mean [m], (...)."""
        u, v, phase, height = self.waves.T
        return np.cos(uv[..., :1] * u + uv[..., 1:2] * v + phase) @ height

    def place(self, local: np.ndarray) -> np.ndarray:
        """Local coordinates [m] to the camera frame [m], (..., 3)."""
        return self.center + local @ self.axes

    def upper(self, uv: np.ndarray) -> np.ndarray:
        """Points of the upper side, camera frame [m], (..., 3)."""
        return self.place(np.concatenate([uv, -self.relief(uv)[..., None]], -1))


@dataclass(frozen=True)
class Grip:
    """A ball of tissue around a point of the upper side, carried without turning."""

    uv: np.ndarray
    """[m], (2,)."""
    radius: float
    """[m]."""


@dataclass(frozen=True)
class Block:
    """The mesh at rest."""

    points: np.ndarray
    """Camera frame [m], (N, 3)."""
    uv: np.ndarray
    """[m], (N, 2)."""
    cells: np.ndarray
    """(M, 8), in the order of elements.CORNERS with xi along u, eta along v, zeta into the tissue."""
    fixed: np.ndarray
    """Held still, (N,) bool."""
    gripped: np.ndarray
    """In or on the driven ball, (N,) bool."""
    upper: np.ndarray
    """The upper side, (N,) bool."""
    triangles: np.ndarray
    """The upper side and the four sides, outward by the right hand, (F, 3)."""


def mesh(shape: Shape, grip: Grip, spacing: float, *, hold_sides: bool) -> Block:
    """Hexahedra of about `spacing` [m]; nodes nearest to the grip's sphere are moved onto it."""
    if grip.radius >= shape.thickness - spacing:
        raise Problem(
            f"phantom: a grip of radius {grip.radius} m reaches the base of tissue {shape.thickness} m thick. "
            "Use a smaller grip_radius or thicker tissue."
        )
    counts = np.maximum(np.rint([*((shape.high - shape.low) / spacing), shape.thickness / spacing]).astype(int), 2)
    nodes = counts + 1
    steps = [np.linspace(0, 1, n) for n in nodes]
    # Fractions of the extent; array axes are (depth, v, u).
    down, back, along = np.meshgrid(steps[2], steps[1], steps[0], indexing="ij")
    uv = shape.low + np.stack([along, back], -1) * (shape.high - shape.low)
    local, gripped = _onto_sphere(shape, grip, _local(shape, uv, down), down)
    edge = np.zeros(nodes[::-1], bool)
    edge[-1] = True
    if hold_sides:
        edge[:, [0, -1]] = edge[:, :, [0, -1]] = True
    index = np.arange(nodes.prod()).reshape(nodes[::-1])
    corner = ((CORNERS + 1) // 2).astype(int)
    size = counts[::-1]
    cells = np.stack([index[k : k + size[0], j : j + size[1], i : i + size[2]].ravel() for i, j, k in corner], -1)
    return Block(
        points=shape.place(local.reshape(-1, 3)),
        uv=local[..., :2].reshape(-1, 2),
        cells=cells,
        fixed=edge.ravel(),
        gripped=gripped.ravel(),
        upper=(down == 0).ravel(),
        triangles=_skin(index),
    )


def _local(shape: Shape, uv: np.ndarray, down: np.ndarray) -> np.ndarray:
    """Lattice columns run from the upper side to the flat base."""
    top = -shape.relief(uv)
    return np.concatenate([uv, (top + down * (shape.thickness - top))[..., None]], -1)


def _onto_sphere(shape, grip, local, down):
    """Move every node within half an edge of the sphere onto it, so no lattice edge crosses it elsewhere.

    Upper nodes stay on the upper side. The nodes around follow smoothly. The sphere is larger than the grip's by
    what the chords between its nodes cut off, so that their hull has the ball's volume.
    """
    center = np.append(grip.uv, -shape.relief(grip.uv))
    edges = [np.linalg.norm(np.diff(local, axis=axis), axis=-1) for axis in range(3)]
    spacing = np.mean([e.mean() for e in edges])
    radius = grip.radius * (1 + CHORDS * (spacing / grip.radius) ** 2)
    moved = local.copy()
    away = np.linalg.norm(local - center, axis=-1)
    near = np.abs(away - radius) < max(e.max() for e in edges) / 2
    upper = down == 0
    ray = (local - center)[near & ~upper]
    moved[near & ~upper] = center + ray * (radius / np.linalg.norm(ray, axis=-1, keepdims=True))
    flat = (local[..., :2] - grip.uv)[near & upper]
    scale = np.ones(len(flat))
    for _ in range(60):  # the relief makes this a fixed point, not a formula
        at = grip.uv + flat * scale[:, None]
        reach = np.linalg.norm(_local(shape, at, np.zeros(len(at))) - center, axis=-1)
        scale *= radius / reach
    moved[near & upper] = _local(shape, grip.uv + flat * scale[:, None], np.zeros(len(flat)))
    gripped = near | (away < radius)
    shift = moved - local
    free = ~near
    free[-1] = False
    free[:, [0, -1]] = free[:, :, [0, -1]] = False
    for _ in range(8):
        pad = np.pad(shift, ((1, 1), (1, 1), (1, 1), (0, 0)), mode="edge")
        mean = sum(np.roll(pad, s, axis)[1:-1, 1:-1, 1:-1] for axis in range(3) for s in (-1, 1)) / 6
        shift[free] = mean[free]
    result = local + shift
    result[0] = _local(shape, result[0, ..., :2], np.zeros(result.shape[1:3]))
    result[near] = moved[near]
    return result, gripped


def _skin(index: np.ndarray) -> np.ndarray:
    """Triangles of the upper side and the four sides of a lattice of node numbers (depth, v, u)."""
    sheets = [index[0].T, index[:, 0], index[:, -1].T, index[:, :, 0].T, index[:, :, -1]]
    return np.concatenate([_split(sheet) for sheet in sheets])


def _split(sheet: np.ndarray) -> np.ndarray:
    """Two triangles per quad of a sheet of node numbers."""
    a, b, c, d = (s.ravel() for s in (sheet[:-1, :-1], sheet[1:, :-1], sheet[1:, 1:], sheet[:-1, 1:]))
    return np.concatenate([np.stack([a, d, c], -1), np.stack([a, c, b], -1)])
