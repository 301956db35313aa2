"""A take of the silicone beam as a recording: which marker is where, and when the beam was let go.

The beam of beam.stl, 30 x 30 x 100 mm, is fixed by one end (z = 100 mm there) to a wall and reaches out level; height
is x. The makers give where markers 6 mm off the surface are (their `target_points`): three around the free end, three
on the wall's front. Dubied, Michelis, Spielberg and Katzschmann, Sim-to-real for differentiable projective dynamics
on soft robots, RA-L 2022.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from surgisim.recordings.c3d import Markers, read_c3d
from surgisim.recordings.mesh import closed, read_stl
from surgisim.recordings.recording import Recording, no_grips

MAKERS_E, MAKERS_DROP = 263824.0, 0.00675
"""What the makers fitted [Pa], and how far their COMSOL model with nu 0.499 falls with it [m]."""
FPS = 100.0
DENSITY = 1070.0
"""The makers' [kg/m^3]."""
GRAVITY = 9.807
PLACES = 1e-3 * np.array([[36, 15, 0], [24, -6, 0], [6, 36, 0], [-1, -10, 94], [27.5, 40, 94], [0, 40, 94]])
"""The makers' marker places in beam.stl's axes [m]: tips 1-3, bases 1-3."""
CLAMP = 0.0025
"""Depth of the held end [m]: one layer of particles."""
SIGMA = 5e-6
"""Noise of a marker [m], its scatter over the last half second."""
SPEED = 0.02
"""The beam has been let go once a tip marker moves this fast [m/s]."""


def take(path: Path) -> Recording:
    """The take from its release on; its three tip markers are the tracked points.

    Frame 0 is the last one in which the beam was still held.
    """
    markers = read_c3d(path)
    start = release(markers)
    points, up = aligned(markers)
    points = points[:3, start:]
    mesh = closed(read_stl(path.parent / "beam.stl", unit=1e-3), "beam.stl")
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    clamp = np.array([[[*(low[:2] - 1e-3), high[2] - CLAMP], [*(high[:2] + 1e-3), high[2] + 1e-3]]])
    return Recording(
        name=path.stem,
        fps=markers.fps,
        mesh=mesh,
        boxes=clamp,
        points=points.astype(np.float32),
        visible=np.isfinite(points).all(-1),
        sigma=np.full(3, SIGMA),
        motion=no_grips(points.shape[1]),
        density=DENSITY,
        gravity=tuple((-GRAVITY * up).tolist()),
        starts="released",
    )


def release(markers: Markers) -> int:
    """The last frame before the tip moves."""
    step = np.linalg.norm(np.diff(markers.points[:3], axis=1), axis=-1).mean(0)
    # The holder is set down in the first tenth of a second of each take.
    quiet = markers.fps // 5
    return int(quiet + np.argmax(step[int(quiet) :] > SPEED / markers.fps))


def aligned(markers: Markers) -> tuple[np.ndarray, np.ndarray]:
    """Markers in beam.stl's axes [m], (6, T, 3), and the laboratory's upward direction there, (3,).

    Turned and shifted as a whole so that the held beam's markers lie as near as can be to the makers' places; the
    beam turns out to slope by 7 degrees against the laboratory's axes.
    """
    held = markers.points[:, release(markers)]
    turn, _ = Rotation.align_vectors(PLACES - PLACES.mean(0), held - held.mean(0))
    turn = turn.as_matrix()
    return (markers.points - held.mean(0)) @ turn.T + PLACES.mean(0), turn[:, 0]


def tip(points: np.ndarray) -> np.ndarray:
    """Height of the free end [m], (T,): the mean of the tip markers (K, T, 3)."""
    return points[..., 0].mean(0)
