"""Forces beside points tell a base's modulus."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from planted import GRID, TRUE, case_of, memo_of, recording

from surgisim.diagnosis.base import simulate
from surgisim.diagnosis.clip import clip_of
from surgisim.diagnosis.model import base_numbers
from surgisim.diagnosis.pulls import SHARE, Pulls, counted
from surgisim.mpm.reaction import reactions
from surgisim.recordings.forces import Forces

SIGMA = 1e-3
"""[N]"""


@cache
def held_only(measured: bool):
    """A recording of which nothing is fitted after the release, with or without the grip's force."""
    made = recording()
    clip = clip_of(made, share=GRID)
    prepared = clip.prepared(("neo_hookean_ciarlet", "newtonian"))
    drive, run = simulate(prepared, clip, TRUE, memo_of(made), clip.frames)
    force = reactions(prepared.simulator, drive, run)[1:]
    force = force + SIGMA * np.random.default_rng(3).standard_normal(force.shape)
    told = Forces(force, np.full(1, SIGMA)) if measured else None
    return replace(made, split={"fit": (0, 16), "held_out": (16, 32)}, forces=told)


def pulls(simulated, measured) -> Pulls:
    n = len(simulated)
    return Pulls(TRUE, np.array(measured), np.array(simulated), np.zeros(n), np.zeros(n), np.zeros(n, int), np.ones(n))


def test_force_goes_with_the_modulus():
    found = pulls([10.0, 20.0], [20.0, 40.0])
    assert found.at(TRUE + np.log(2.0) * np.eye(3)[0]) == pytest.approx([20.0, 40.0])
    assert found.cost(TRUE + np.log(2.0) * np.eye(3)[0]) == pytest.approx(0.0)


def test_a_force_that_is_off_as_a_whole_is_off_by_its_share_however_little_its_noise():
    measured = np.array([1e3, 2e3, -5e2])
    found = pulls((1 + SHARE) * measured, measured)
    assert found.cost(TRUE) == pytest.approx(1.0, rel=1e-3)
    # Noise across its course draws the modulus nowhere.
    noise = 10 * np.array([2.0, -1.0, 0.0]) / np.sqrt(5.0)
    costs = [pulls(measured, measured + noise).cost(TRUE + d * np.eye(3)[0]) for d in (-0.02, 0.0, 0.02)]
    assert costs[1] < min(costs[::2])
    # Of covariance I + s^2 m m'.
    whole = np.linalg.inv(np.eye(3) + SHARE**2 * np.outer(measured, measured))
    left = np.array([3.0, -2.0, 7.0])
    assert (found.white(left) ** 2).sum() == pytest.approx(left @ whole @ left, rel=1e-6)


def test_forces_count_while_a_grip_surely_holds_and_where_they_are_numbers():
    made = held_only(True)
    force = made.forces.force.copy()
    force[0, 9] = np.nan
    clip = clip_of(replace(made, forces=Forces(force, np.ones(1))), share=GRID)
    which = counted(clip)
    assert not which[0].any()
    # Gripped from frame 4 on; frames from 16 on are held out.
    assert np.flatnonzero(which[1].all(-1)).tolist() == [5, 6, 7, 8, 10, 11, 12, 13, 14, 15]


@pytest.mark.slow
def test_with_forces_a_clip_without_a_release_tells_the_modulus():
    with_forces, without = (case_of(held_only(m), model_error=0) for m in (True, False))
    E, blind = (base_numbers(case.base)["E"] for case in (with_forces, without))
    true = float(np.exp(TRUE[0]))
    assert E["low"] < true < E["high"]
    assert E["high"] / E["low"] < 1.7
    assert E["value"] == pytest.approx(true, rel=0.15)
    assert blind["high"] / blind["low"] > 3
    assert with_forces.base.pulls.told(with_forces.base.x)["rms_left"] < 4 * SIGMA
