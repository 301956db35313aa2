"""Errors by phase: what they are of, how sure they are, and that no baseline is made weaker than it is."""

import dataclasses

import numpy as np
import pytest
from measure.test_evaluation import run_of
from report.made_up import invent

from surgisim.measure.compared import with_grip
from surgisim.measure.groups.depth_change import depth_change
from surgisim.measure.groups.grip_path import grip_path
from surgisim.measure.groups.simulation_by_phase import simulation_by_phase
from surgisim.measure.resample import mean, median, ratio
from surgisim.measure.spans import THREE


@pytest.fixture(scope="module")
def made():
    return invent((40, 48), 32, 0)


def test_an_interval_holds_the_truth_as_often_as_it_says():
    rng = np.random.default_rng(0)
    held = 0
    for seed in range(200):
        # 40 points with an error of their own each, seen in 10 frames that tell nothing new of it.
        own = rng.exponential(1.0, (40, 1))
        found = ratio(np.repeat(own, 10, 1).sum(1), np.full(40, 10), seed=seed)
        held += found.low <= 1.0 <= found.high
    assert 160 <= held <= 196


def test_too_few_points_have_no_interval():
    found = ratio(np.ones(4), np.ones(4))
    assert (found.value, found.low, found.high, found.count) == (1.0, None, None, 4)
    assert ratio(np.ones(3), np.zeros(3)).count == 0
    assert np.isnan(mean(np.full(9, np.nan)).value)


def test_a_median_counts_what_it_is_told_to():
    values = np.arange(20.0).reshape(10, 2)
    assert median(values, np.ones((10, 2), bool)).value == 9.5
    assert median(values, np.broadcast_to([True, False], (10, 2))).value == 9.0


def test_a_replay_nine_tenths_as_far_is_a_tenth_of_still_in_every_phase(made):
    entries = simulation_by_phase(run_of(made))
    for span in THREE:
        found = entries[f"true_held_out_{span}_moving_of_still"]
        assert found["value"] == pytest.approx(10, abs=1)
        assert found["low"] <= found["value"] <= found["high"]


def test_a_still_replay_is_a_hundred_per_cent_of_still(made):
    stays = np.broadcast_to(made["body"].rest, made["replay"].position.shape)
    still = dataclasses.replace(made["replay"], nodes=0 * made["replay"].nodes, position=stays)
    entries = simulation_by_phase(run_of(made, replay=still))
    for span in THREE:
        assert entries[f"tracked_held_out_{span}_moving_of_still_px"]["value"] == pytest.approx(100)
    assert depth_change(run_of(made, replay=still))["replay_change_hold_share"]["value"] == pytest.approx(100)


def test_a_rigid_body_goes_with_the_nearest_holding_grip_and_returns(made):
    motion = made["motion"]
    moved = with_grip(motion, np.array([[0.0, 0.0, 0.07], [np.nan, 0, 0]]))
    held = motion.active[0]
    assert moved[0, held] == pytest.approx(motion.position[0, held] - motion.center_rest[0])
    assert not moved[:, ~held].any()


def test_a_depth_that_never_changes_is_off_by_all_of_the_change(made):
    z = np.broadcast_to(made["depth"].z[:1], made["depth"].z.shape)
    # Sampled along the moving points' pixels, so flat: a slope would change it.
    flat = dataclasses.replace(made["depth"], z=np.full_like(z, 0.07), scale="known")
    entries = depth_change(run_of(made, depth=flat))
    for span in THREE:
        assert entries[f"change_{span}_share"]["value"] == pytest.approx(100)
    assert depth_change(run_of(made))["change_load_share"]["value"] < 15


def test_a_path_that_stays_at_its_depth_is_off_by_how_near_it_came(made):
    motion = made["motion"]
    position = motion.position.copy()
    position[..., 2] = motion.center_rest[:, None, 2]
    level = dataclasses.replace(motion, position=position)
    entries = grip_path(dataclasses.replace(run_of(made), found=level))
    assert entries["path_fitted_hold_share"]["value"] == 0
    assert entries["path_found_hold_across_share"]["value"] == 0
    length = np.linalg.norm(np.diff(motion.position[0][motion.active[0]], axis=0), axis=-1).sum()
    held = motion.active[0] & (np.arange(32) > 16)
    wanted = 100 * np.abs(motion.position[0, held, 2] - motion.center_rest[0, 2]).mean() / length
    assert entries["path_found_hold_along_share"]["value"] == pytest.approx(wanted, rel=0.05)


def test_a_guessed_depth_neither_chooses_the_points_nor_counts_in_space(made):
    rng = np.random.default_rng(0)
    noise = np.zeros_like(made["tracks"].xyz)
    noise[..., 2] = rng.normal(0, 0.02, noise.shape[:2])
    noise[:, 0] = 0
    guessed = dataclasses.replace(made["tracks"], xyz=made["tracks"].xyz + noise)
    depth = dataclasses.replace(made["depth"], follows=False)
    entries = simulation_by_phase(run_of(made, tracks=guessed, depth=depth))
    name = "tracked_held_out_hold_moving_of_still_px"
    assert entries[name] == simulation_by_phase(run_of(made, depth=depth))[name]
    assert "tracked_held_out_hold_moving" not in entries
    assert entries["tracked_held_out_pull_moving"]["value"] is None


def test_points_that_the_body_has_not_are_told(made):
    far = dataclasses.replace(made["body"], rest=made["body"].rest + np.float32(1.0))
    entries = simulation_by_phase(run_of(made, body=far))
    assert entries["true_moving_on_body"]["value"] == 0
    assert entries["true_held_out_hold_moving"]["value"] is None
