"""Small causes are answered by the tangent stiffness as the engine itself answers them."""

import numpy as np
import pytest
from planted import BLOB, FIT, GRID, TRUE, recording

from surgisim.diagnosis.base import SAFETY, base_drive, carried, values_of
from surgisim.diagnosis.clip import clip_of
from surgisim.diagnosis.tangent import base_piola, tangent

HELD = 16
"""A frame in which the pull is held."""


@pytest.fixture(scope="module")
def moved():
    clip = clip_of(recording(), share=GRID)
    values = values_of(TRUE)
    prepared = clip.prepared(tuple(values))
    drive = base_drive(prepared, clip, values)
    run = prepared.simulator.run(prepared.theta(values), drive, last=HELD + 1)
    return clip, prepared, values, run, tangent(prepared, values, drive, run, clip.rest, HELD + 2)


def simulated(clip, extra, place):
    values = {**values_of(TRUE), **extra}
    prepared = clip.prepared(tuple(values))
    theta = prepared.theta(values, place)
    per_frame = prepared.per_frame_of(prepared.stiffest(theta), clip.fps, SAFETY)
    drive = prepared.drive(clip.motion, values, fps=clip.fps, per_frame=per_frame, places=place)
    run = prepared.simulator.run(theta, drive, last=HELD + 1)
    return carried(prepared.simulator.carry(clip.rest), run)


def alike(a, b):
    return float((a * b).sum() / np.sqrt((a**2).sum() * (b**2).sum()))


def test_a_lump_changes_the_hold_as_the_tangent_says(moved):
    clip, prepared, _, run, near = moved
    weight = BLOB.weight(prepared.simulator.rest)[:, None, None]
    loads = [near.of_stress(weight * base_piola(prepared, values_of(TRUE), near.gradient(f))) for f in near.frames]
    found = near.over_time(near.at_states(np.stack(loads)[:, None])[:, 0])[:, HELD]
    plain = carried(prepared.simulator.carry(clip.rest), run)[:, HELD]
    wanted = (simulated(clip, {"stiff_inclusion": {"s": 1.1}}, {"stiff_inclusion": BLOB})[:, HELD] - plain) / 0.1
    assert alike(found, wanted) > 0.99
    assert np.linalg.norm(found) == pytest.approx(np.linalg.norm(wanted), rel=0.1)


def test_shares_of_states_add_up(moved):
    *_, near = moved
    assert np.allclose(near.share.sum(1), 1)
    assert FIT > HELD
