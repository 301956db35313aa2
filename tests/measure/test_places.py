"""Metrics of places: tracks, depth, grasps, and a body carried by a replay."""

import dataclasses

import numpy as np
import pytest
from report.made_up import invent

from surgisim.artifacts.motion import Motion
from surgisim.measure.carried import carried
from surgisim.measure.depth_error import depth_error, scale_between
from surgisim.measure.distance import distance, distance_over_time
from surgisim.measure.flow_at import flow_at
from surgisim.measure.grasp_error import grasp_error
from surgisim.measure.phases import phases
from surgisim.measure.sanity import sanity
from surgisim.measure.truth_seen import seen

rng = np.random.default_rng(0)


@pytest.fixture(scope="module")
def made():
    return invent((40, 48), 12, 0)


def motion(release: int = 8) -> Motion:
    way = np.interp(np.arange(12), [0, 2, 5, 11], [0, 0, 1, 1])
    position = (np.array([0.0, 0, 0.1]) + way[:, None] * np.array([0.003, 0, 0.004]))[None]
    active = (np.arange(12) < release)[None] & (np.arange(12) >= 1)
    return Motion(position[:, 0], np.array([0.004]), position, active, np.ones(1), "given")


def test_three_and_four_apart_is_five():
    found, true = np.zeros((3, 2, 2)), np.full((3, 2, 2), (3.0, 4.0))
    counted = np.array([[1, 1], [1, 0], [0, 1]], bool)
    found[0, 0] = np.nan
    apart = distance(found, true, counted)
    assert (apart.median, apart.mean, apart.count) == (5, 5, 3)
    assert distance_over_time(found, true, counted).tolist() == [5, 5]
    assert np.isnan(distance(found, true, np.zeros((3, 2), bool)).median)


def test_tracks_that_move_alike_tell_exactly_where_a_pixel_between_them_went():
    start = rng.uniform(0, 40, (60, 2))
    bend = np.array([[1.1, 0.2], [-0.1, 0.9]])
    xy = np.stack([start, start @ bend + 3], 1)
    inside, outside = np.array([[20.0, 20.0]]), np.array([[60.0, 20.0]])
    went = flow_at(inside, xy, np.ones((60, 2), bool))
    assert np.allclose(went[0, 1], inside[0] @ bend + 3)
    assert np.isnan(flow_at(outside, xy, np.ones((60, 2), bool))).all()


def test_hidden_tracks_tell_nothing():
    xy = np.repeat(rng.uniform(0, 40, (60, 1, 2)), 2, 1)
    visible = np.ones((60, 2), bool)
    visible[:, 1] = False
    went = flow_at(np.array([[20.0, 20.0]]), xy, visible)
    assert np.isfinite(went[0, 0]).all()
    assert np.isnan(went[0, 1]).all()


def test_a_depth_off_by_a_factor_alone_is_right_after_scaling():
    true = rng.uniform(0.05, 0.1, (3, 8, 8))
    true[0, 0, 0] = 0
    every = np.ones(true.shape, bool)
    found = np.where(true > 0, true, 1) / 1.7
    scale = scale_between(found, true, every)
    assert scale == pytest.approx(1.7)
    error = depth_error(found, true, every, scale=scale)
    assert error.relative == pytest.approx(0, abs=1e-12)
    assert depth_error(found, true, every).relative == pytest.approx(1 - 1 / 1.7)
    assert depth_error(found, np.zeros_like(true), every) is None


def test_a_grasp_found_beside_and_too_late_says_by_how_much():
    true, found = motion(release=8), motion(release=10)
    beside = np.array([0.003, 0, 0])
    moved = dataclasses.replace(found, center_rest=found.center_rest + beside, position=found.position + beside)
    error = grasp_error(moved, true)
    assert error.center == pytest.approx(0.003)
    assert error.path == pytest.approx(0.003)
    assert error.release == 2
    nothing = Motion(np.zeros((0, 3)), np.zeros(0), np.zeros((0, 12, 3)), np.zeros((0, 12), bool), np.zeros(0), "none")
    assert grasp_error(nothing, true) is None


def test_a_clip_rests_is_loaded_is_held_and_let_go():
    assert " ".join(dict.fromkeys(phases(motion()))) == "rest load hold released"
    assert phases(motion())[[0, 4, 7, 9]].tolist() == ["rest", "load", "hold", "released"]


def test_a_replay_carries_points_between_its_nodes(made):
    body, replay = made["body"], made["replay"]
    path = carried(replay, body, body.rest[:50].astype(float))
    assert np.allclose(path, replay.position[:, :50].transpose(1, 0, 2), atol=2e-4)


def test_a_point_off_the_body_is_not_carried(made):
    path = carried(made["replay"], made["body"], np.array([[0, 0, 0.05], [np.nan, 0, 0]]))
    assert np.isnan(path).all()


def test_a_whole_replay_is_sane_and_a_torn_or_flying_one_is_not(made):
    body, replay, grasp, camera = (made[name] for name in ("body", "replay", "motion", "camera"))
    whole = sanity(replay, body, grasp, camera)
    assert whole.sane
    assert whole.largest == pytest.approx(0.9 * whole.grip, rel=0.05)
    torn = dataclasses.replace(replay, smallest_volume_ratio=replay.smallest_volume_ratio - 0.5)
    assert not sanity(torn, body, grasp, camera).sane
    far = replay.position.copy()
    far[3, 7] += 0.05
    assert not sanity(dataclasses.replace(replay, position=far), body, grasp, camera).sane


def test_the_truth_follows_the_recording_through_crop_and_resize(made):
    truth, camera = made["truth"], made["camera"]
    smaller = dataclasses.replace(camera, crop=[8, 4, 32, 32], width=16, height=16)
    found = seen(truth, smaller)
    assert np.allclose(found.xy[:, 0], (truth.pixels - [8, 4] + 0.5) / 2 - 0.5, atol=1e-3)
    assert found.tool.shape == (12, 16, 16)
    assert np.allclose(found.depth[0], truth.depth[0, 4:36, 8:40][::2, ::2], atol=2e-3)
    assert np.allclose(seen(truth, camera).xy, camera.project(truth.xyz), atol=1e-3)
