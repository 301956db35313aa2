"""A closed triangle mesh around the thickened body, empty inside.

Its edges are springs, and across each edge one joins the corners that face each other, against bending.
"""

import numpy as np

from surgisim.artifacts.body import Body
from surgisim.baselines.springs import Network, joined
from surgisim.problem import Problem
from surgisim.skin import edges, skin, width


def network(body: Body, modulus: float) -> Network:
    """Its skin is as thick as a particle is wide and has this Young's modulus [Pa]: springs in all directions of a
    plane alike have E t = 8 mu / 3 and mu = sum k L^2 / (8 A), so that sum k L^2 = 3 E t A; Poisson's ratio is 1/3.

    Raises Problem where the particles enclose nothing.
    """
    place, wide, faces = body.rest.astype(float), width(body), skin(body)
    if not len(faces):
        raise Problem(f"baseline mesh: {len(place)} particles enclose no volume. Thicken the surface.")
    vertices, faces = np.unique(faces, return_inverse=True)
    faces = faces.reshape(-1, 3)
    corners = place[vertices][faces]
    area = 0.5 * float(np.linalg.norm(np.cross(*np.diff(corners, axis=1).swapaxes(0, 1)), axis=1).sum())
    pairs, stiffness = joined(place[vertices], springs(faces), body.torn, 3 * modulus * wide * area, "mesh")
    return Network(vertices, place[vertices], pairs, stiffness)


def springs(faces: np.ndarray) -> np.ndarray:
    """Edges of triangles (F, 3), and the corners that face each other across those that two share, (S, 2) int."""
    corner = faces.T.ravel()
    once, which, count = np.unique(edges(faces), axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(which.ravel(), kind="stable")
    begins = np.cumsum(count) - count
    two = begins[count == 2]
    facing = np.stack([corner[order[two]], corner[order[two + 1]]], 1)
    return np.unique(np.sort(np.concatenate([once, facing]), axis=1), axis=0)
