"""Bodies at rest: slabs, mounds, flaps and tubes as linear tetrahedra, and the boxes that hold them."""

from dataclasses import dataclass
from itertools import permutations

import numpy as np

KINDS = ("slab", "mound", "flap", "tube")
SUPPORTS = {
    "slab": ("plate", "layer", "sides", "patches"),
    "mound": ("plate", "layer", "patches"),
    "flap": ("side",),
    "tube": ("ends",),
}
"""What may hold each kind of body."""
LARGEST = 7.5e-3
"""Of cells [m]: a grip has to hold several points."""
THIN = 1.5e-4
"""Half the thickness of a box that holds a plane [m]."""
# A cube's corners by their bits x, y, z; its six tetrahedra around the diagonal 0-7 (Kuhn), one for each order of axes.
KUHN = np.array(
    [[0, 1 << a, (1 << a) | (1 << b), 7] for a, b, _ in permutations(range(3))]
)  # fmt: skip


@dataclass(frozen=True)
class Body:
    kind: str
    support: str
    points: np.ndarray
    """At rest, recording's frame [m], (N, 3)."""
    tets: np.ndarray
    """(M, 4), each of positive volume."""
    upper: np.ndarray
    """Triangles of the side that a camera sees, (F, 3)."""
    skin: np.ndarray
    """All triangles around the body, outward by the right hand, (S, 3)."""
    held: np.ndarray
    """Held still, (N,) bool."""
    boxes: list[dict]
    """The same as fixed.json says it."""
    out: np.ndarray
    """Unit vectors out of the body at `upper`'s corners, (N, 3); 0 at points that are none."""
    thickness: float
    """[m]"""

    @property
    def volume(self) -> np.ndarray:
        """Of each tetrahedron [m^3], (M,)."""
        return volumes(self.points, self.tets)


def volumes(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Signed, [m^3], (M,)."""
    a, b, c, d = np.moveaxis(points[tets], 1, 0)
    return np.einsum("mi,mi->m", np.cross(b - a, c - a), d - a) / 6


def draw(rng: np.random.Generator, kind: str, support: str, spacing: float) -> Body:
    """A body of a kind with a support, in cells of about `spacing` times its thickness, or 8 % of its length."""
    size, place = _shape(rng, kind)
    length, width, thickness = size
    cell = min(max(spacing * thickness, 0.08 * max(length, width)), LARGEST)
    counts = np.maximum(np.rint(np.array(size) / cell).astype(int), [4, 4, 2])
    u, v, w = (np.linspace(0, 1, n + 1) for n in counts)
    grid = np.stack(np.meshgrid(u, v, w, indexing="ij"), -1)
    points = place(grid.reshape(-1, 3))
    index = np.arange(len(points)).reshape(grid.shape[:3])
    corner = [index[i : i + counts[0], j : j + counts[1], k : k + counts[2]].ravel() for k, j, i in _bits()]
    tets = np.stack(corner, -1)[:, KUHN].reshape(-1, 4)
    w_of = grid[..., 2].ravel()
    if kind == "tube":
        points, tets, keep = _merged(points, tets)
        w_of = w_of[keep]
    wrong = volumes(points, tets) < 0
    tets[wrong] = tets[wrong][:, [0, 1, 3, 2]]
    turn = _turn(rng, axis_aligned=support not in ("plate", "layer"))
    held, boxes = _supports(rng, points, w_of, support, cell, turn)
    skin = _skin(tets)
    top = w_of > 1 - 1e-9
    upper = skin[top[skin].all(1)]
    moved = points @ turn.T
    return Body(kind, support, moved, tets, upper, skin, held, boxes, _normals(moved, upper), thickness)


def _bits():
    return [(c >> 2 & 1, c >> 1 & 1, c & 1) for c in range(8)]


def _shape(rng: np.random.Generator, kind: str):
    """Length, width and thickness [m], and the map from the unit cube, third axis outward, to metres."""
    if kind == "tube":
        radius, wall, length = rng.uniform(0.008, 0.014), rng.uniform(0.004, 0.007), rng.uniform(0.04, 0.07)
        flat = rng.uniform(0.75, 1.0)

        def tube(p):
            angle, r = 2 * np.pi * p[:, 0], radius + wall * p[:, 2]
            return np.stack([r * np.cos(angle), flat * r * np.sin(angle), length * (p[:, 1] - 0.5)], 1)

        return (2 * np.pi * (radius + wall), length, wall), tube
    low, high = {"slab": (0.008, 0.030), "mound": (0.012, 0.040), "flap": (0.005, 0.012)}[kind]
    thickness = np.exp(rng.uniform(np.log(low), np.log(high)))
    length, width = rng.uniform(max(0.04, 1.5 * thickness), 0.075), rng.uniform(max(0.03, 1.5 * thickness), 0.06)
    waves = _waves(rng, 0.04 * thickness)
    sink = rng.uniform(0.25, 0.55) if kind == "mound" else 0.0

    def slab(p):
        x, y = length * (p[:, 0] - 0.5), width * (p[:, 1] - 0.5)
        rise = 1 - sink * (1 - np.cos(np.pi * (p[:, 0] - 0.5)) * np.cos(np.pi * (p[:, 1] - 0.5)))
        height = thickness * rise + waves(x, y)
        return np.stack([x, y, p[:, 2] * height], 1)

    return (length, width, thickness), slab


def _waves(rng: np.random.Generator, rms: float, count: int = 6):
    """A height [m] over x, y [m] that rises and falls by `rms`."""
    length, way, phase = rng.uniform(0.02, 0.06, count), rng.uniform(0, 2 * np.pi, (2, count)), rms * np.sqrt(2 / count)
    number = 2 * np.pi / length

    def height(x, y):
        along = np.outer(x, np.cos(way[0]) * number) + np.outer(y, np.sin(way[0]) * number)
        return phase * np.cos(along + way[1]).sum(1)

    return height


def _merged(points: np.ndarray, tets: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points that coincide become one; also which of the old ones each is."""
    _, keep, where = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    return points[keep], where.reshape(-1)[tets], keep


def _turn(rng: np.random.Generator, *, axis_aligned: bool) -> np.ndarray:
    """A rotation that leaves boxes boxes: about the third axis by any angle where only planes across it are held."""
    angle = rng.integers(4) * np.pi / 2 if axis_aligned else rng.uniform(0, 2 * np.pi)
    c, s = np.cos(angle), np.sin(angle)
    about = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    order = np.eye(3)[rng.permutation(3)] * rng.choice([-1.0, 1.0], (3, 1))
    if np.linalg.det(order) < 0:
        order[0] *= -1
    return order @ about


def _supports(rng, points, w, support, cell, turn) -> tuple[np.ndarray, list[dict]]:
    """Which points are held, and the boxes [m] that say so, in the turned frame."""
    low, high = points.min(0), points.max(0)
    reach = np.linalg.norm(high - low)
    below = np.array([[-reach, -reach, -THIN], [reach, reach, THIN]])
    if support in ("plate", "layer"):
        # A plate is part of nothing; a layer holds what lies in it too.
        top = THIN if support == "plate" else 0.35 * cell
        return points[:, 2] <= top, [_box(below + np.array([[0, 0, 0], [0, 0, top - THIN]]), turn)]
    if support == "patches":
        boxes = []
        for _ in range(2):
            middle, half = rng.uniform(0.3, 0.7, 2), rng.uniform(0.2, 0.32, 2)
            near, far = (low[:2] + (middle + side * half) * (high - low)[:2] for side in (-1, 1))
            boxes.append(np.array([[*near, -THIN], [*far, THIN]]))
        inside = np.any([((points >= b[0]) & (points <= b[1])).all(1) for b in boxes], 0)
        return inside & (w < 1e-9), [_box(b, turn) for b in boxes]
    axis, ends = {"side": (0, (0,)), "sides": (0, (0, 1)), "ends": (2, (0, 1))}[support]
    held, boxes = np.zeros(len(points), bool), []
    for end in ends:
        at = (low, high)[end][axis]
        box = np.array([low - reach, high + reach])
        box[:, axis] = at - THIN, at + THIN
        held |= np.abs(points[:, axis] - at) < THIN
        boxes.append(_box(box, turn))
    return held, boxes


def _box(corners: np.ndarray, turn: np.ndarray) -> dict:
    """Of two corners [m], (2, 3), in the turned frame."""
    eight = np.stack(np.meshgrid(*corners.T, indexing="ij"), -1).reshape(-1, 3) @ turn.T
    return {"min": eight.min(0).tolist(), "max": eight.max(0).tolist()}


def _skin(tets: np.ndarray) -> np.ndarray:
    faces = np.concatenate([tets[:, f] for f in ([0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2])])
    _, first, count = np.unique(np.sort(faces, 1), axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[count == 1])]


def _normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    normal = np.zeros_like(points)
    np.add.at(normal, triangles, np.cross(b - a, c - a)[:, None])
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.divide(normal, size, out=np.zeros_like(normal), where=size > 0)
