"""What a clip concealed is told at the tracks' points, in their frame and scale, and over their noise."""

from dataclasses import replace

import numpy as np
import pytest
from proof.made_up import effect, recording

from surgisim.artifacts.camera import Camera
from surgisim.problem import Problem
from surgisim.proof.tracked import as_tracked
from surgisim.proof.truth import Truth

SCALE, FOCAL, ASSUMED = 0.7, 200.0, 144.0
SEEN_BY = {"width": 160, "height": 128, "focal": FOCAL, "cx": 79.5, "cy": 63.5}
CAMERA = Camera(
    160, 128, ASSUMED, ASSUMED, 79.5, 63.5, 10.0, 40, "arbitrary", "assumed", "clip.mp4", [160, 128], [0, 0, 160, 128]
)
STRETCH = np.array([SCALE * FOCAL / ASSUMED] * 2 + [SCALE])
PLACE = [0.004, -0.003, 0.09]

NUMBERS = {"force": {"value": 0.1, "unit": "N"}, "way": {"value": [0, 0, 1], "unit": "1"}}


def surface() -> np.ndarray:
    """A bent sheet before the camera [m], (N, 3)."""
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-0.03, 0.03, 31), np.linspace(-0.025, 0.025, 26)))
    return np.stack([x, y, 0.08 + 0.004 * np.cos(60 * x)], -1)


def moved(points: np.ndarray, by: float) -> np.ndarray:
    """Their paths, raised by up to `by` [m] in the middle of the clip, (N, T, 3)."""
    rise = np.sin(np.pi * np.arange(40) / 40) * np.exp(-((points[:, :1] / 0.015) ** 2))
    return points[:, None] - by * rise[..., None] * np.array([0, 0, 1.0])


@pytest.fixture
def filmed():
    """A truth, and a recording of every fifth point of its surface by a camera that knows neither focal nor scale."""
    rest, made = surface(), recording(sigma=1e-4)
    told = {
        "snr": 9.0, "snr_held_out": 9.0, "noise": 3e-4, "camera": SEEN_BY,
        "base": {"E": 1000.0, "nu": 0.45, "eta": 2.0, "density": 1050.0},
        "effects": [effect(place={"center": PLACE, "extent": 0.006, "unit": "m"}, parameters=NUMBERS)],
    }  # fmt: skip
    truth = Truth(told, moved(rest, 0.005), moved(rest, 0.006))
    inner = rest[(np.abs(rest[:, 0]) < 0.028) & (np.abs(rest[:, 1]) < 0.023)][::5]
    points, count = (STRETCH * moved(inner, 0.006)).astype(np.float32), len(inner)
    return truth, replace(
        made, points=points, visible=np.ones((count, 40), bool), sigma=np.full(count, 1e-4), place=STRETCH * inner,
        axes=np.tile(np.sqrt([0.3, 0.3, 2.4]), (count, 1)),
    )  # fmt: skip


def test_paths_are_those_of_the_points_in_their_own_frame(filmed):
    truth, tracks = filmed
    found = as_tracked(truth, tracks, CAMERA)
    assert found.told["scale"] == pytest.approx(SCALE, rel=1e-3)
    assert np.abs(found.true - tracks.points).max() < 2e-5


def test_a_place_stays_at_its_pixel_and_numbers_take_the_scale_with_them(filmed):
    told = as_tracked(*filmed, CAMERA).told
    place = told["effects"][0]["place"]
    true = np.array(PLACE)
    assert CAMERA.project(np.array(place["center"])) == pytest.approx(
        FOCAL * true[:2] / true[2] + [79.5, 63.5], abs=0.1
    )
    assert place["extent"] == pytest.approx(0.006 * SCALE, rel=1e-3)
    assert told["effects"][0]["parameters"]["force"]["value"] == pytest.approx(0.1 * SCALE**4, rel=1e-2)
    assert told["effects"][0]["parameters"]["way"]["value"] == [0, 0, 1]
    assert told["base"]["E"] == pytest.approx(1000 * SCALE**2, rel=1e-2)
    assert told["base"]["nu"] == 0.45


def test_the_ratio_is_over_the_tracks_own_noise_axis_by_axis(filmed):
    truth, tracks = filmed
    told = as_tracked(truth, tracks, CAMERA).told
    fitted = slice(0, tracks.fitted_until)
    along = STRETCH[2] * (moved(surface(), 0.006) - moved(surface(), 0.005))[:, fitted, 2]
    assert told["snr"] == pytest.approx(np.sqrt((along**2).mean()) / (1e-4 * np.sqrt(2.4)), rel=0.1)
    assert told["snr_set"] == 9.0
    loud = as_tracked(truth, replace(tracks, sigma=3 * tracks.sigma), CAMERA).told
    assert loud["snr"] == pytest.approx(told["snr"] / 3)


def test_a_clip_that_was_cropped_and_shrunk_is_the_same(filmed):
    truth, tracks = filmed
    # Half the size of what is left of column 20 and row 10 on.
    half = replace(
        CAMERA, width=70, height=59, fx=ASSUMED / 2, fy=ASSUMED / 2, cx=(79.5 - 20 + 0.5) / 2 - 0.5,
        cy=(63.5 - 10 + 0.5) / 2 - 0.5, crop=[20, 10, 140, 118],
    )  # fmt: skip
    found = as_tracked(truth, tracks, half)
    assert np.nanmax(np.abs(found.true - tracks.points)) < 2e-5


def test_points_off_the_known_surface_have_no_path_and_too_few_are_refused(filmed):
    truth, tracks = filmed
    aside = tracks.place.copy()
    aside[0, 0] += 0.2
    found = as_tracked(truth, replace(tracks, place=aside), CAMERA)
    assert np.isnan(found.true[0]).all()
    assert np.isfinite(found.true[1:]).all()
    with pytest.raises(Problem, match="points lie on the surface"):
        as_tracked(truth, replace(tracks, place=tracks.place + np.array([0.5, 0, 0])), CAMERA)


def test_a_truth_of_no_clip_is_refused(filmed):
    truth, tracks = filmed
    plain = replace(truth, told={k: v for k, v in truth.told.items() if k != "camera"})
    with pytest.raises(Problem, match="it is of no clip"):
        as_tracked(plain, tracks, CAMERA)
