"""The same recording in another frame of reference."""

import dataclasses
import itertools

import numpy as np

from surgisim.proof.perturb.mount import held_face
from surgisim.recordings.mesh import Mesh
from surgisim.recordings.recording import Recording


def rotated(recording: Recording, rng: np.random.Generator) -> Recording:
    """Everything, gravity too, turned about the origin by one rotation drawn from all that boxes allow.

    Boxes have their faces along the axes: so it is any angle about the axis along which all of them enter the body,
    where they cover it sideways, and then one of the 23 turns that carry axes into axes.
    """
    axis = _free_axis(recording)
    if axis is not None:
        recording = _turned(recording, _about(axis, rng.uniform(0, 2 * np.pi)), _covering(axis))
    cube = _cube_turns()
    return _turned(recording, cube[rng.integers(1, len(cube))], _of_corners)


def _turned(recording: Recording, turn: np.ndarray, boxed) -> Recording:
    motion, gravity = recording.motion, recording.gravity
    mesh = Mesh(recording.mesh.vertices @ turn.T, recording.mesh.faces)
    return dataclasses.replace(
        recording,
        mesh=mesh,
        boxes=boxed(recording.boxes, turn, mesh),
        points=(recording.points @ turn.T).astype(np.float32),
        place=None if recording.place is None else recording.place @ turn.T,
        gravity=None if gravity is None else tuple((turn @ gravity).tolist()),
        motion=dataclasses.replace(motion, center_rest=motion.center_rest @ turn.T, position=motion.position @ turn.T),
    )


def _free_axis(recording: Recording) -> int | None:
    """The axis about which boxes may turn by any angle: all enter along it, and cover the body across."""
    low, high = recording.mesh.vertices.min(0), recording.mesh.vertices.max(0)
    axes = {held_face(recording, b)[0] for b in range(len(recording.boxes))}
    if len(axes) != 1:
        return None
    across = [a for a in range(3) if a not in axes]
    least, most = recording.boxes[:, 0, across], recording.boxes[:, 1, across]
    return axes.pop() if (least <= low[across]).all() and (most >= high[across]).all() else None


def _covering(axis: int):
    """Boxes that keep their extent along `axis` and cover the turned body across it."""

    def boxed(boxes: np.ndarray, turn: np.ndarray, mesh: Mesh) -> np.ndarray:
        low, high = mesh.vertices.min(0), mesh.vertices.max(0)
        room = 0.01 * (high - low)
        covering = np.tile(np.stack([low - room, high + room]), (len(boxes), 1, 1))
        covering[..., axis] = boxes[..., axis]
        return covering

    return boxed


def _of_corners(boxes: np.ndarray, turn: np.ndarray, mesh: Mesh) -> np.ndarray:
    corners = boxes @ turn.T
    return np.stack([corners.min(1), corners.max(1)], 1)


def _about(axis: int, angle: float) -> np.ndarray:
    turn = np.eye(3)
    a, b = (axis + 1) % 3, (axis + 2) % 3
    turn[a, a] = turn[b, b] = np.cos(angle)
    turn[b, a], turn[a, b] = np.sin(angle), -np.sin(angle)
    return turn


def _cube_turns() -> np.ndarray:
    """The rotations that carry axes into axes, (24, 3, 3), the identity first."""
    signed = [
        np.eye(3)[list(order)] * np.array(signs)[:, None]
        for order in itertools.permutations(range(3))
        for signs in itertools.product((1, -1), repeat=3)
    ]
    return np.array([turn for turn in signed if np.linalg.det(turn) > 0])
