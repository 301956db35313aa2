"""The closed surface around a body's particles, as triangles between them."""

import numpy as np
from scipy.spatial import Delaunay

from surgisim.artifacts.body import Body
from surgisim.mpm.tear import Tear

ALPHA = 1.4
"""Largest radius of the empty balls that the surface rolls over [particle widths]: those of a cubic lattice's own cells
have .87."""
FACES = ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))
"""Faces of a tetrahedron, the k-th without corner k; their normals point out where (b - a) x (c - a) . (d - a) > 0."""
EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))


def skin(body: Body, some: np.ndarray | None = None) -> np.ndarray:
    """Triangles between particles around the body, or around `some` of them, (P,) bool, and along both sides of its
    tears, (F, 3) int: every edge has an even number of them, and (b - a) x (c - a) points out. What is one particle
    thick encloses nothing and is left out, all or in part."""
    chosen = np.arange(len(body.rest)) if some is None else np.flatnonzero(some)
    return chosen[alpha_shape(body.rest[chosen].astype(float), ALPHA * width(body), Tear(body.torn.astype(float)))]


def width(body: Body) -> float:
    """How wide a particle is [m]."""
    return float(np.cbrt(np.median(body.volume.astype(float))))


def alpha_shape(place: np.ndarray, alpha: float, tear: Tear | None = None) -> np.ndarray:
    """Triangles around points [m], (P, 3), as an alpha shape has them, (F, 3) int; alpha: largest radius [m].

    Edelsbrunner and Mücke, Three-dimensional alpha shapes, ACM Trans. Graph. 13 (1994). Empty where the points enclose
    nothing.
    """
    if len(place) < 5:
        return np.empty((0, 3), int)
    # Points of a lattice lie on common spheres, by eights: moved by a trace, no four of them are flat.
    shaken = place + 1e-4 * alpha * np.random.default_rng(0).standard_normal(place.shape)
    cells = Delaunay(shaken).simplices
    cells = cells[_radius(shaken[cells]) <= alpha]
    if tear is not None and len(tear.walls):
        for a, b in EDGES:
            cells = cells[~tear.crosses(place[cells[:, a]], place[cells[:, b]])]
    turned = np.linalg.det(shaken[cells[:, 1:]] - shaken[cells[:, :1]]) < 0
    cells[turned, 2:] = cells[turned, :1:-1]
    faces = np.concatenate([cells[:, list(face)] for face in FACES])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[first[count == 1]]


def watertight(faces: np.ndarray) -> bool:
    """Whether triangles (F, 3) leave no edge open."""
    return len(faces) > 0 and bool((np.unique(edges(faces), axis=0, return_counts=True)[1] % 2 == 0).all())


def edges(faces: np.ndarray) -> np.ndarray:
    """Ends of each triangle's sides, the smaller number first: all that face corner 0, then 1, then 2, (3 F, 2) int."""
    return np.sort(np.concatenate([faces[:, [1, 2]], faces[:, [0, 2]], faces[:, [0, 1]]]), axis=1)


def normals(place: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Outward unit normals at points (P, 3), each the mean of its triangles' by area; zero away from the surface."""
    a, b, c = (place[faces[:, k]] for k in range(3))
    each = np.cross(b - a, c - a)
    total = np.zeros_like(place)
    for k in range(3):
        np.add.at(total, faces[:, k], each)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), np.finfo(float).tiny)


def volume(place: np.ndarray, faces: np.ndarray) -> float:
    """What triangles enclose [m^3]."""
    a, b, c = (place[faces[:, k]] - place.mean(0) for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def _radius(corners: np.ndarray) -> np.ndarray:
    """Radius of the ball through the corners of tetrahedra [m], (C, 4, 3) -> (C,)."""
    sides = corners[:, 1:] - corners[:, :1]
    middle = np.linalg.solve(sides, 0.5 * (sides**2).sum(2)[..., None])
    return np.linalg.norm(middle[..., 0], axis=1)
