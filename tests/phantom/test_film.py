"""The pictures and the truth agree, and a seed decides both."""

import io
import json

import av
import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from tissue_pieces import SMALL

from surgisim.artifacts.base import encoded
from surgisim.phantom import clip, instrument
from surgisim.phantom.case import invent
from surgisim.phantom.clip import film
from surgisim.phantom.law import Law
from surgisim.phantom.timeline import Timeline
from surgisim.phantom.video import encode
from surgisim.problem import Problem


def pixels_of(truth):
    camera = json.loads(truth.parameters)["camera"]
    return truth.xyz[..., :2] / truth.xyz[..., 2:] * camera["fx"] + [camera["cx"], camera["cy"]]


def test_one_seed_one_clip(small_film):
    again = film(SMALL)
    assert encode(again[0], 25.0, 12) == encode(small_film[0], 25.0, 12)
    header = {"producer": "phantom", "settings": {}, "code": ""}
    assert encoded(again[1], **header) == encoded(small_film[1], **header)


def test_one_encoding_of_the_same_frames(small_film):
    assert len({encode(small_film[0][4:16], 25.0, 12) for _ in range(25)}) == 1


def test_another_seed_is_another_scene():
    first, second = invent(SMALL), invent(SMALL.model_copy(update={"seed": 8}))
    assert not np.allclose(first.shape.waves, second.shape.waves)
    assert not np.allclose(first.pull, second.pull)


def test_points_stay_on_their_texture(small_film):
    frames, truth = small_film
    grey, at = frames.astype(float).mean(-1), pixels_of(truth)
    held = 10
    both = truth.visible[:, 0] & truth.visible[:, held]
    tone = [map_coordinates(grey[t], at[both, t, ::-1].T, order=1) for t in (0, held)]
    stayed = map_coordinates(grey[held], at[both, 0, ::-1].T, order=1)
    followed = np.corrcoef(tone)[0, 1]
    assert followed > 0.85
    assert followed > np.corrcoef(tone[0], stayed)[0, 1] + 0.05


def test_points_lie_at_the_true_depth(small_film):
    _, truth = small_film
    column, row = np.rint(truth.pixels).astype(int).T
    assert np.allclose(truth.xyz[:, 0, 2], truth.depth[0, row, column], atol=1e-6)
    assert truth.visible[:, 0].all()
    assert len(truth.pixels) == pytest.approx(SMALL.points, rel=0.15)


def test_the_tool_mask_is_what_the_tool_changes(small_film, monkeypatch):
    behind = np.array([[-0.1, 0.0, 0.2, 0.1, 0.0, 0.2, 0.02, 0.02, instrument.SHAFT]])
    monkeypatch.setattr(clip, "tool_at", lambda case, t: behind)
    bare, hidden = film(SMALL)
    assert not hidden.tool.any()
    frames, truth = small_film
    changed = (frames != bare).any(-1)
    assert not (changed & ~truth.tool).any()
    assert (changed & truth.tool).sum() > 0.98 * truth.tool.sum()
    assert truth.tool[4].mean() > 0.02


def test_gripped_tissue_goes_where_the_truth_says(small_film):
    _, truth = small_film
    near = np.linalg.norm(truth.xyz[:, 0] - truth.center_rest[0], axis=1) < 0.6 * truth.radius[0]
    held = np.flatnonzero(truth.active[0])
    shift = truth.xyz[near][:, held] - truth.xyz[near][:, :1]
    assert near.any()
    assert np.allclose(shift, (truth.position[0] - truth.center_rest[0])[held], atol=2e-6)


def test_released_tissue_swings_past_rest_and_settles():
    _, truth = film(SMALL.model_copy(update={"duration": 1.2}))
    pull = truth.position[0, -1] - truth.center_rest[0]
    near = np.linalg.norm(truth.xyz[:, 0] - truth.center_rest[0], axis=1) < 2 * truth.radius[0]
    share = (truth.xyz[near] - truth.xyz[near][:, :1]) @ pull / (pull @ pull)
    after = share.mean(0)[12:]
    assert -0.4 < after.min() < -0.03
    assert np.abs(after[-5:]).max() < 0.01


def test_without_viscosity_the_release_looks_different(small_film):
    _, truth = small_film
    _, elastic = film(SMALL.model_copy(update={"eta": 0.0}))
    gap = np.linalg.norm(pixels_of(truth) - pixels_of(elastic), axis=-1)
    assert gap[:, :12].mean() < 0.1
    assert np.sqrt((gap[:, -4:] ** 2).mean()) > 0.4


def test_the_video_plays_back_what_was_seen(small_film):
    frames, _ = small_film
    with av.open(io.BytesIO(encode(frames, 25.0, 12))) as video:
        stream = video.streams.video[0]
        assert stream.average_rate == 25
        back = np.stack([f.to_ndarray(format="rgb24") for f in video.decode(stream)])
    assert back.shape == frames.shape
    assert 10 * np.log10(255**2 / ((back.astype(float) - frames) ** 2).mean()) > 32


def test_phases_out_of_order_are_refused():
    with pytest.raises(Problem, match="order"):
        Timeline(grasp=0.2, pull=0.1, hold=0.5, release=1.0, end=2.0)


def test_impossible_tissue_is_refused():
    with pytest.raises(Problem, match="nu"):
        Law(E=1000.0, nu=0.5, eta=1.0, density=1000.0)


def test_too_violent_a_pull_stops_and_says_when():
    with pytest.raises(Problem, match=r"at 0\.\d+ s"):
        film(SMALL.model_copy(update={"pull": 0.08, "hold": 0.24}))
