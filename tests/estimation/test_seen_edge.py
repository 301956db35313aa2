"""The edge of a picture is carried as it is seen to go, where a body whose edge is left alone fits far worse."""

from dataclasses import replace

import numpy as np
import pytest
from slab import pulled
from slab_clip import CAMERA, QUICK, TRUE, T, alone, clip, silent

from surgisim.artifacts.tracks import Tracks
from surgisim.config.estimation import Estimation
from surgisim.estimation.fit import estimate
from surgisim.estimation.rim import PATCHES, seen_rim

AWAY = np.array([0.012, 0.006, 0.0])
"""How far everything beyond the picture goes in the end [m]."""


def tracks_of(moved: np.ndarray, rest: np.ndarray) -> Tracks:
    """Points at rest (K, 3) that move so [m], (K, T, 3)."""
    xyz = rest[:, None] + moved
    k = xyz.shape[:2]
    xy = CAMERA.project(xyz)
    return Tracks(
        xy.astype(np.float32), np.ones(k, bool), np.full(k, 0.1, np.float32), xyz.astype(np.float32),
        np.full((*k, 2), 3e-5, np.float32),
    )  # fmt: skip


def face() -> np.ndarray:
    """Points of the slab's face, closely, (K, 3)."""
    x, y = np.meshgrid(np.linspace(-0.0235, 0.0235, 40), np.linspace(-0.0175, 0.0175, 30))
    return np.stack([x.ravel(), y.ravel(), np.full(x.size, 0.06)], 1)


def test_patches_follow_the_median_of_their_points_and_cross_gaps_evenly():
    rest = face()
    moved = np.linspace(0, 1, T)[None, :, None] * np.where(rest[:, :1] > 0, 1.0, -0.5)[:, None] * AWAY
    tracks = tracks_of(moved, rest)
    visible = tracks.visible.copy()
    visible[:, 10:12] = False
    xy = np.where(visible[..., None], tracks.xy, 1e4)
    # A tenth of the points are lost to something else.
    xy[::10, 3:] += 40.0
    rim = seen_rim(replace(tracks, visible=visible, xy=xy.astype(np.float32)), pulled(frames=T), CAMERA, 0.003)
    assert PATCHES // 2 <= len(rim.radius) <= PATCHES
    far = np.where(rim.position[:, :1, 0] > 0, 1.0, -0.5)
    wanted = np.linspace(0, 1, T)[:, None] * AWAY * far[:, None]
    inner = np.abs(rim.position[:, 0, 0]) > 0.004
    assert inner.any()
    assert (rim.position - rim.position[:, :1])[inner] == pytest.approx(wanted[inner], abs=3e-4)


def test_patches_come_nearer_only_where_that_is_measured():
    nearer = np.array([0.0, 0.0, -0.004])
    tracks = tracks_of(np.linspace(0, 1, T)[None, :, None] * np.ones((1200, 1, 1)) * nearer, face())
    rim = seen_rim(tracks, pulled(frames=T), CAMERA, 0.003)
    assert (rim.position[:, -1] - rim.position[:, 0])[:, 2] == pytest.approx(-0.004, abs=3e-4)
    guessed = replace(tracks, sigma_xyz=np.full_like(tracks.sigma_xyz, 0.006))
    rim = seen_rim(guessed, pulled(frames=T), CAMERA, 0.003)
    assert (rim.position[:, -1] - rim.position[:, 0])[:, 2] == pytest.approx(0.0, abs=1e-9)


def test_an_edge_that_is_hardly_seen_says_nothing():
    tracks = tracks_of(np.zeros((1200, T, 3)), face())
    visible = np.arange(T) < 0.5 * T
    half = replace(tracks, visible=np.broadcast_to(visible, tracks.visible.shape).copy())
    assert seen_rim(half, pulled(frames=T), CAMERA, 0.003) is None
    few = replace(tracks, visible=tracks.visible & (np.arange(1200) % 40 == 0)[:, None])
    assert seen_rim(few, pulled(frames=T), CAMERA, 0.003) is None


@pytest.fixture(scope="module")
def quick():
    return Estimation(**QUICK | {"iterations": 1})


def fitted(moved: np.ndarray | None, settings: Estimation):
    """The fit of a pulled slab that something else moves so, grip and all, (T, 3) [m]."""
    case = list(clip(TRUE))
    if moved is not None:
        rest = case[2].xyz[:, 0].astype(float)
        case[2] = tracks_of(case[2].xyz - rest[:, None] + moved, rest)
        case[3] = replace(case[3], position=case[3].position + moved)
    return estimate(*case, settings, silent)


@pytest.mark.slow(40)
def test_a_still_surrounding_is_left_alone(quick, monkeypatch):
    alone(monkeypatch)
    found = fitted(None, quick)
    assert found.fit.held_out["support"]["patches"] == 0
    assert not len(found.motion.rim)


@pytest.mark.slow(70)
def test_a_surrounding_that_goes_away_carries_the_edge(quick, monkeypatch):
    alone(monkeypatch)
    found = fitted(np.linspace(0, 1, T)[:, None] * AWAY, quick)
    patches = found.fit.held_out["support"]["patches"]
    assert patches > PATCHES // 2
    assert f"At {patches} places along the edge of the picture" in found.fit.words
    assert found.motion.rim[:, -1] - found.motion.rim[:, 0] == pytest.approx(np.tile(AWAY, (patches, 1)), abs=1e-3)
    assert found.fit.held_out["fitted"] < 0.5 * found.fit.held_out["default"]
    # A body that hangs is fitted before it is compared with one that is held from below.
    kinds = {h["as"]: h["cost"] for h in found.fit.history if h["round"] == "hold" and "grip" not in h}
    assert {"carried edge", "hung"} <= set(kinds)
    assert bool(found.body.held.any()) == (kinds["carried edge"] < kinds["hung"])
