"""A closed triangle mesh around the thickened body, empty inside.

Its edges are springs, and across each edge one joins the corners that face each other, against bending.
"""

import numpy as np
from scipy.spatial import Delaunay

from surgisim.artifacts.body import Body
from surgisim.baselines.springs import Network, joined
from surgisim.problem import Problem

ALPHA = 1.4
"""Largest radius of the empty balls that the surface rolls over [particle widths]: those of a cubic lattice's own cells
have .87."""
CORNERS = ((1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2))
"""Faces of a tetrahedron."""


def network(body: Body, modulus: float) -> Network:
    """Its skin is as thick as a particle is wide and has this Young's modulus [Pa]: springs in all directions of a
    plane alike have E t = 8 mu / 3 and mu = sum k L^2 / (8 A), so that sum k L^2 = 3 E t A; Poisson's ratio is 1/3.

    Raises Problem where the particles enclose nothing.
    """
    place, wide = body.rest.astype(float), float(np.cbrt(np.median(body.volume.astype(float))))
    faces = surface(place, ALPHA * wide)
    if not len(faces):
        raise Problem(f"baseline mesh: {len(place)} particles enclose no volume. Thicken the surface.")
    vertices, faces = np.unique(faces, return_inverse=True)
    faces = faces.reshape(-1, 3)
    corners = place[vertices][faces]
    area = 0.5 * float(np.linalg.norm(np.cross(*np.diff(corners, axis=1).swapaxes(0, 1)), axis=1).sum())
    pairs, stiffness = joined(place[vertices], springs(faces), body.torn, 3 * modulus * wide * area, "mesh")
    return Network(vertices, place[vertices], pairs, stiffness)


def surface(place: np.ndarray, alpha: float) -> np.ndarray:
    """Triangles around the points [m], (P, 3), as an alpha shape has them, (F, 3) int; alpha: largest radius [m].

    Edelsbrunner and Mücke, Three-dimensional alpha shapes, ACM Trans. Graph. 13 (1994).
    """
    # Points of a lattice lie on common spheres, by eights: moved by a trace, no four of them are flat.
    place = place + 1e-4 * alpha * np.random.default_rng(0).standard_normal(place.shape)
    cells = Delaunay(place).simplices
    cells = cells[_radius(place[cells]) <= alpha]
    faces = np.sort(np.concatenate([cells[:, list(c)] for c in CORNERS]), axis=1)
    each, count = np.unique(faces, axis=0, return_counts=True)
    return each[count == 1]


def springs(faces: np.ndarray) -> np.ndarray:
    """Edges of triangles (F, 3), and the corners that face each other across those that two share, (S, 2) int."""
    edge = np.sort(np.concatenate([faces[:, [1, 2]], faces[:, [0, 2]], faces[:, [0, 1]]]), axis=1)
    corner = faces.T.ravel()
    edges, which, count = np.unique(edge, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(which.ravel(), kind="stable")
    begins = np.cumsum(count) - count
    two = begins[count == 2]
    facing = np.stack([corner[order[two]], corner[order[two + 1]]], 1)
    return np.unique(np.sort(np.concatenate([edges, facing]), axis=1), axis=0)


def _radius(corners: np.ndarray) -> np.ndarray:
    """Radius of the ball through the corners of tetrahedra [m], (C, 4, 3) -> (C,)."""
    sides = corners[:, 1:] - corners[:, :1]
    middle = np.linalg.solve(sides, 0.5 * (sides**2).sum(2)[..., None])
    return np.linalg.norm(middle[..., 0], axis=1)
