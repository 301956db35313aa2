"""Another lens or another shape leaves every pixel where it was."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.motion import Motion
from surgisim.estimation.doubts import as_shown
from surgisim.estimation.lay import Columns
from surgisim.estimation.observation import Filmed
from surgisim.estimation.search import search
from surgisim.estimation.unknown import Unknown
from surgisim.estimation.view import View

CAMERA = Camera(64, 48, 80.0, 80.0, 31.5, 23.5, 25.0, 6, "arbitrary", "assumed", "clip", [64, 48], [0, 0, 64, 48])
OTHER = {"lens": 1.3, "right": 0.2, "down": -0.1, "bowl": 0.5}


def view(**change):
    return View(CAMERA, np.array([0.05, -0.02]), **change)


def points(n=40, seed=0):
    rng = np.random.default_rng(seed)
    return np.concatenate([rng.uniform(-0.015, 0.015, (n, 2)), rng.uniform(0.055, 0.065, (n, 1))], 1)


def motion():
    center = np.array([[0.004, 0.002, 0.06]])
    path = np.linspace(0, 1, 6)[:, None] * np.array([0.003, 0.001, -0.004])
    return Motion(center, np.array([0.005]), (center + path)[None], np.ones((1, 6), bool), np.ones(1), "found")


def test_pixels_stay():
    changed = view(**OTHER)
    rest = points()
    assert changed.seen_by.project(rest * changed.factor(rest)) == pytest.approx(CAMERA.project(rest), abs=1e-9)
    before, after = motion(), changed.motion(motion())
    assert changed.seen_by.project(after.position) == pytest.approx(CAMERA.project(before.position), abs=1e-9)


def test_what_one_standard_deviation_is_stays():
    rest, changed = points(), view(**OTHER)
    shape = (len(rest), 6, 3)
    rng = np.random.default_rng(1)
    moved = rng.normal(0, 1e-3, shape)
    seen = Filmed(
        rest,
        moved,
        np.full(shape, 1e4),
        sparse.csr_matrix((len(rest), 1)),
        CAMERA,
        CAMERA.project(rest[:, None] + moved),
    )
    here, there = seen.apart(0 * moved, np.arange(6)), changed.observation(seen)
    apart = there.weight * there.apart(0 * moved, np.arange(6))
    # Across the view, where a picture shows it; the same displacement toward the camera is a longer one farther off.
    assert apart == pytest.approx(1e4 * here, abs=1e-8)


def test_nothing_changed_changes_nothing():
    rest = points()
    assert view().factor(rest) == pytest.approx(np.ones_like(rest))


def test_a_longer_lens_makes_a_narrower_body_as_deep():
    top = points()
    n = len(top)
    laid = Columns(
        top[:, :2], top[:, 2] + 0.001, top[:, 2], np.full(n, 4e-6), np.zeros((n, 3)), np.ones(n, bool),
        np.zeros(n, bool), 0.004, 0.002, 0.02,
    )  # fmt: skip
    seen = view(lens=1.25).columns(laid)
    assert seen.area == pytest.approx(laid.area / 1.25**2)
    assert seen.begin - seen.above == pytest.approx(laid.begin - laid.above)
    assert seen.thickness == laid.thickness


def test_a_longer_lens_asks_for_shorter_lengths_and_softer_tissue():
    depth = Unknown("held.depth", 0.0, 0.6, -1.0, 1.0, "m", True, 0.02)
    wanted = replace(search(["corotated", "newtonian"], {}, []), depth=depth)
    x = view(lens=1.3).alike(wanted.start, wanted) - wanted.start
    moved = dict(zip(wanted.names, x, strict=True))
    assert moved["held.depth"] == pytest.approx(-np.log(1.3))
    assert moved["corotated.E"] == pytest.approx(-2 * np.log(1.3))
    assert moved["newtonian.eta"] == pytest.approx(-2 * np.log(1.3))
    assert moved["corotated.nu"] == 0


def test_what_pixels_show_of_a_displacement_is_that_displacement():
    rest = points()
    moved = np.random.default_rng(4).normal(0, 1e-6, (len(rest), 6, 3))
    shift = CAMERA.project(rest[:, None] + moved) - CAMERA.project(rest)[:, None]
    assert as_shown(rest, shift, moved[..., 2], CAMERA) == pytest.approx(moved, abs=1e-9)
