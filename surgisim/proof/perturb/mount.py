"""Where the body is said to be held: with its mounting plate or without, and to which height."""

import dataclasses

import numpy as np

from surgisim.phantom.folder import MOUNT, THIN
from surgisim.problem import Problem
from surgisim.recordings.mesh import Mesh, closed
from surgisim.recordings.recording import Recording

LEVEL = 1e-7
"""Heights that differ by less are one plane [m]."""


def without_plate(recording: Recording) -> Recording:
    """The skin of the tissue alone, held in a box of THIN around its lowest plane.

    Raises Problem where the body does not stand on a flat plate of MOUNT that one box holds.
    """
    if not plated(recording):
        raise Problem(f"recording {recording.name}: has no mounting plate of {MOUNT} m. Perturb it in another way.")
    vertices, faces = recording.mesh.vertices.copy(), recording.mesh.faces
    axis, sign, plane = held_face(recording, 0)
    height = sign * (vertices[:, axis] - plane)
    # The plate's walls become triangles of no area, which `closed` drops.
    vertices[height < LEVEL, axis] = plane
    mesh = closed(Mesh(vertices, faces), f"recording {recording.name} without its plate")
    boxes = recording.boxes.copy()
    boxes[0, :, axis] = plane - THIN / 2, plane + THIN / 2
    return dataclasses.replace(recording, mesh=mesh, boxes=boxes)


def bare(recording: Recording) -> Recording:
    """Without its plate where it has one."""
    return without_plate(recording) if plated(recording) else recording


def plated(recording: Recording) -> bool:
    """Whether the body stands on a flat plate of MOUNT that one box holds."""
    if len(recording.boxes) != 1:
        return False
    axis, sign, plane = held_face(recording, 0)
    height = sign * (recording.mesh.vertices[:, axis] - plane)
    plate = height[height < -LEVEL]
    return len(plate) > 0 and abs(plate.min() + MOUNT) < LEVEL and np.ptp(plate) < LEVEL


def reaching(recording: Recording, depth: float) -> Recording:
    """Every box reaches this deep into the body [m], from the side on which it enters."""
    boxes = recording.boxes.copy()
    for b, box in enumerate(boxes):
        axis, sign, _ = held_face(recording, b)
        side = recording.mesh.vertices[:, axis].min() if sign > 0 else recording.mesh.vertices[:, axis].max()
        face = int(sign > 0)
        box[face, axis] = side + sign * depth
        # The other face stays outside of the body.
        box[1 - face, axis] = min(box[0, axis], side) if sign > 0 else max(box[1, axis], side)
    return dataclasses.replace(recording, boxes=boxes)


def shifted(recording: Recording, by: float) -> Recording:
    """The plane in which each box ends stated deeper in the body by this much [m], or less deep where negative.

    A box without thickness left, or one thinner than the shift, moves as a whole.
    """
    boxes = recording.boxes.copy()
    for b, box in enumerate(boxes):
        axis, sign, _ = held_face(recording, b)
        face = int(sign > 0)
        thin = box[1, axis] - box[0, axis] <= abs(by)
        box[:, axis] += sign * by if thin else 0.0
        box[face, axis] += 0.0 if thin else sign * by
    return dataclasses.replace(recording, boxes=boxes)


def held_face(recording: Recording, b: int) -> tuple[int, int, float]:
    """Axis along which box `b` enters the body, 1 from its lower side or -1 from its upper, and where it ends [m].

    Of all sides of the body that the box reaches over, the one from which it covers least. Raises Problem where the box
    enters from no side, or holds the whole body.
    """
    low, high = recording.mesh.vertices.min(0), recording.mesh.vertices.max(0)
    (least, most), found = recording.boxes[b], []
    for axis in range(3):
        long = high[axis] - low[axis]
        if least[axis] <= low[axis] + LEVEL and most[axis] < high[axis]:
            found.append(((most[axis] - low[axis]) / long, axis, 1, float(most[axis])))
        if most[axis] >= high[axis] - LEVEL and least[axis] > low[axis]:
            found.append(((high[axis] - least[axis]) / long, axis, -1, float(least[axis])))
    if not found:
        raise Problem(f"recording {recording.name}: box {b} enters the body from no side. Perturb it in another way.")
    return min(found)[1:]
