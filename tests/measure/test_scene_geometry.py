"""Scenes that stand still, stretch, fold, float or bristle are told apart from one that moves as tissue does."""

from dataclasses import replace

import numpy as np
import pytest
from report.made_up import invent
from scipy.spatial import cKDTree
from test_evaluation import run_of

from surgisim.measure.groups import scene_geometry as geometry


@pytest.fixture(scope="module")
def run():
    return run_of(invent((40, 48), 16, 0))


def values(run) -> dict[str, float]:
    return {name: entry["value"] for name, entry in geometry.scene_geometry(run).items()}


def test_a_scene_that_stands_still_is_as_far_off_as_standing_still(run):
    told = values(run)
    assert told["motion_share"] == pytest.approx(100)
    assert told["motion"] == told["motion_still"]
    assert told["true_motion_share"] == pytest.approx(100)
    assert told["folded"] == told["floating"] == told["spikes"] == 0
    assert told["strain_95"] < 1e-6


def test_one_that_goes_where_tracks_go_is_right(run, monkeypatch):
    """Tracks are noisy; the field is as if it knew them all."""
    paths = np.where(np.isfinite(run.tracks.xyz), run.tracks.xyz, 0.0).astype(float)
    nearest = cKDTree(paths[:, 0])

    def carried(points, field, time):
        k = nearest.query(points)[1]
        return points + paths[k, round(time * run.camera.fps)] - paths[k, 0]

    monkeypatch.setattr(geometry, "displace", carried)
    told = values(run)
    assert told["motion_share"] < 30
    # These tracks are the true paths and noise.
    assert told["true_motion_share"] < 30


def test_stretch_is_told_as_it_is(run, monkeypatch):
    monkeypatch.setattr(geometry, "displace", lambda points, field, time: points * [1.2, 1.2, 1.2])
    told = values(run)
    assert told["strain_95"] == pytest.approx(np.log(1.2), rel=1e-5)
    assert told["folded"] == 0


def test_a_surface_turned_over_is_folded(run, monkeypatch):
    monkeypatch.setattr(geometry, "displace", lambda points, field, time: points * ([-1, 1, 1] if time else [1, 1, 1]))
    assert values(run)["folded"] == pytest.approx(100)


def test_splats_that_float_or_bristle_are_counted(run):
    mean, scale = run.scene.mean.copy(), run.scene.scale.copy()
    count = len(mean) // 10
    mean[:count] *= 0.8
    scale[-count:, 0] += np.log(10)
    told = values(replace(run, scene=replace(run.scene, mean=mean, scale=scale)))
    opacity = 1 / (1 + np.exp(-run.scene.opacity.astype(float)))
    assert told["floating"] == pytest.approx(100 * opacity[:count].sum() / opacity.sum(), abs=1.0)
    assert told["spikes"] == pytest.approx(100 * count / len(mean), abs=0.1)
    side = np.ptp(np.percentile(mean, [0.5, 99.5], axis=0), axis=0).max()
    assert told["largest"] == pytest.approx(100 * np.exp(scale[:, 0].max()) / side, rel=1e-4)
    assert told["stretch"] == pytest.approx(np.exp(np.ptp(scale, axis=1).max()), rel=1e-4)
