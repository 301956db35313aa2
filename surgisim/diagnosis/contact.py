"""Whether a push is one that a contact can give: it presses on tissue, and never draws it out of its own surface."""

import numpy as np

from surgisim.physics.place import Place
from surgisim.recordings.recording import Recording

SAMPLES = 20_000
"""Points spread over the body's surface."""
INSIDE = 1e-4
"""How far a box that holds tissue reaches beyond its walls [m]: surfaces lie on them."""


def outward(recording: Recording, place: Place, force: np.ndarray) -> float:
    """How far a force, (3,), points out of the free surface around a place: 1 straight out, -1 straight in.

    The surface's outward normals are averaged over the place; what boxes hold does not count. Where tissue is free on
    both sides, as a thin flap is, they cancel, and any direction is a contact's: near 0. So it is where no free surface
    is within reach, four extents.
    """
    points, normals = _free(recording)
    weight = place.weight(points)
    near = weight > np.exp(-8.0)
    size = float(np.linalg.norm(force))
    if not near.any() or size == 0.0:
        return 0.0
    mean = (weight[near, None] * normals[near]).sum(0) / weight[near].sum()
    return float(mean @ force / size)


def _free(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Points spread evenly over the surface that nothing holds [m], (N, 3), and the unit normals there, (N, 3)."""
    mesh, rng = recording.mesh, np.random.default_rng(0)
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    face = rng.choice(len(area), SAMPLES, p=area / area.sum())
    u, v = np.sqrt(rng.uniform(size=SAMPLES)), rng.uniform(size=SAMPLES)
    points = (1 - u)[:, None] * a[face] + (u * (1 - v))[:, None] * b[face] + (u * v)[:, None] * c[face]
    low, high = recording.boxes[:, 0] - INSIDE, recording.boxes[:, 1] + INSIDE
    held = ((points[:, None] >= low) & (points[:, None] <= high)).all(-1).any(-1)
    return points[~held], (normal[face] / area[face, None])[~held]
