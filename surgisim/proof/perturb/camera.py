"""What a camera does to tracks: it drifts, shakes, and has another focal length than was believed.

Drift and jitter move the tracks alone: body, boxes and grips are those of frame 0, or of the robot.
"""

import dataclasses

import numpy as np
from scipy.spatial.transform import Rotation

from surgisim.recordings.recording import Recording

ARM = 0.025
"""Distance from the middle of the points at which a turn moves as much as a shift [m]."""
WAVES = 3
"""Half periods in a clip of the quickest part of a drift."""


def drifted(recording: Recording, rng: np.random.Generator, most: float) -> Recording:
    """Moved rigidly and smoothly in time, by at most this much at any point in any frame [m]; nothing in frame 0."""
    rest = recording.attached()
    shift, angle = np.swapaxes(smooth(rng, (2, 3), recording.frames), 1, 2)
    arm = (rest - rest.mean(0)) / ARM
    scale = most / np.linalg.norm(shift + np.cross(angle, arm[:, None]), axis=-1).max()
    return _rigidly(recording, scale * shift, scale * angle)


def bent(recording: Recording, rng: np.random.Generator, most: float) -> Recording:
    """Moved smoothly in time and bilinearly over the picture, by at most this much at any point in any frame [m]."""
    rest = recording.attached()[:, :2]
    u, v = ((rest - rest.min(0)) / np.ptp(rest, axis=0)).T
    weight = np.stack([(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v], 1)
    field = np.einsum("kn,nct->ktc", weight, smooth(rng, (4, 3), recording.frames))
    points = recording.points + field * (most / np.linalg.norm(field, axis=-1).max())
    return dataclasses.replace(recording, points=points.astype(np.float32))


def shaken(recording: Recording, rng: np.random.Generator, size: float) -> Recording:
    """Moved rigidly, every frame anew: standard deviation of each axis of the shift, and of the turn at ARM [m]."""
    return _rigidly(recording, *(size * rng.standard_normal((2, recording.frames, 3))))


def zoomed(recording: Recording, factor: float) -> Recording:
    """x and y of everything times `factor`, about the optical axis z; the grips' radii stay."""
    scale, motion = np.array([factor, factor, 1.0]), recording.motion
    return dataclasses.replace(
        recording,
        mesh=dataclasses.replace(recording.mesh, vertices=scale * recording.mesh.vertices),
        boxes=scale * recording.boxes,
        points=(scale * recording.points).astype(np.float32),
        place=None if recording.place is None else scale * recording.place,
        motion=dataclasses.replace(motion, center_rest=scale * motion.center_rest, position=scale * motion.position),
    )


def smooth(rng: np.random.Generator, shape: tuple[int, ...], frames: int) -> np.ndarray:
    """Slow curves that begin at zero without speed, (*shape, T)."""
    wave = np.arange(1, WAVES + 1)
    curve = (1 - np.cos(np.pi * wave[:, None] * np.linspace(0, 1, frames))) / wave[:, None]
    return rng.standard_normal((*shape, WAVES)) @ curve


def _rigidly(recording: Recording, shift: np.ndarray, turn: np.ndarray) -> Recording:
    """Points turned about their middle and shifted; the turn as what it moves at ARM [m], both (T, 3)."""
    center = recording.attached().mean(0)
    moved = np.einsum("tij,ktj->kti", Rotation.from_rotvec(turn / ARM).as_matrix(), recording.points - center)
    return dataclasses.replace(recording, points=(moved + center + shift).astype(np.float32))
