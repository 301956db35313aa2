"""A grip that turns, gives way or holds a smaller ball moves tissue as one that carries what it holds unevenly."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from planted import GRID, TRUE, recording
from scipy.spatial.transform import Rotation

from surgisim.diagnosis.base import SAFETY, base_drive, carried, values_of
from surgisim.diagnosis.clip import clip_of
from surgisim.diagnosis.gripping import UNEVEN, firmness, unevenness
from surgisim.diagnosis.tangent import tangent

HELD, ANGLE = 16, 0.1
"""A frame in which the pull is held; how far the grip has turned by then."""


@pytest.fixture(scope="module")
def gripped():
    """Clip, base's run and tangent, and displacement of the points by the base with other grips."""
    clip, values = replace(clip_of(recording(), share=GRID), until=HELD + 2), values_of(TRUE)
    prepared = clip.prepared(tuple(values))
    plain = base_drive(prepared, clip, values)
    theta = prepared.theta(values)

    def moved(drive) -> np.ndarray:
        run = prepared.simulator.run(theta, drive, last=HELD + 1)
        return carried(prepared.simulator.carry(clip.rest), run)

    run = prepared.simulator.run(theta, plain, last=HELD + 1)
    near = tangent(prepared, values, plain, run, clip.rest, HELD + 2)
    return SimpleNamespace(clip=clip, prepared=prepared, values=values, drive=plain, near=near, moved=moved)


def reach(clip) -> np.ndarray:
    way = clip.motion.position[0, : clip.until] - clip.motion.center_rest[0]
    return np.linalg.norm(way, axis=1) * clip.motion.active[0, : clip.until]


def test_a_grip_that_turns_is_one_of_the_fields_of_first_order(gripped):
    clip, drive = gripped.clip, gripped.drive
    far = np.linalg.norm(drive.path[1], axis=1)
    turn = np.tile(np.eye(3), (*drive.path.shape[:2], 1, 1))
    turn[1] = Rotation.from_rotvec((ANGLE * far / far.max())[:, None] * [0, 0, 1]).as_matrix()
    wanted = (gripped.moved(replace(drive, turn=turn)) - gripped.moved(drive))[:, HELD]
    along = unevenness(clip, gripped.near).columns[:, :, HELD]
    # About z, what sits at (x, y) goes by (-y, x): second axis of the first field less first axis of the second.
    size = ANGLE * clip.motion.radius[0] / (UNEVEN * reach(clip)[HELD])
    found = size * (along[3 * 0 + 1] - along[3 * 1 + 0])
    assert (found * wanted).sum() > 0.98 * np.linalg.norm(found) * np.linalg.norm(wanted)
    assert np.linalg.norm(found) == pytest.approx(np.linalg.norm(wanted), rel=0.1)


@pytest.mark.parametrize("how", ["gives way", "smaller"])
def test_other_grips_are_hardly_anything_else(gripped, how):
    clip = gripped.clip
    motion = replace(clip.motion, radius=0.8 * clip.motion.radius) if how == "smaller" else clip.motion
    per_frame = gripped.prepared.per_frame(gripped.values, clip.fps, SAFETY)
    other = gripped.prepared.drive(
        motion, gripped.values, fps=clip.fps, per_frame=per_frame, frames=clip.frames, late=clip.opening,
        grip=0.1 if how == "gives way" else 1.0,
    )  # fmt: skip
    change = (gripped.moved(other) - gripped.moved(gripped.drive))[:, : clip.until].ravel()
    columns = [make(clip, gripped.near).columns[:, :, : clip.until] for make in (firmness, unevenness)]

    def left(groups) -> float:
        design = np.concatenate(groups).reshape(-1, change.size).T
        return np.linalg.norm(change - design @ np.linalg.lstsq(design, change, rcond=1e-8)[0]) / np.linalg.norm(change)

    assert left(columns) < 0.12
    assert left(columns) < 0.6 * left(columns[:1])


def test_what_no_grip_holds_is_carried_by_none(gripped):
    clip = gripped.clip
    columns = unevenness(clip, gripped.near).columns
    assert len(columns) == 27
    assert not columns[:, :, clip.until :].any()
    assert not columns[:, :, : clip.until][:, :, reach(clip) == 0].any()
