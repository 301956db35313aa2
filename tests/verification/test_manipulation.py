"""The engine does what other finite elements do with pulled tissue."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from surgisim.phantom.elements import SLOPES
from surgisim.phantom.ogrid import mesh
from surgisim.verification import manipulation
from surgisim.verification.manipulated.compare import rebound
from surgisim.verification.manipulated.covariance import covariance, deviation, model_error
from surgisim.verification.manipulated.page import BOUNDS
from surgisim.verification.manipulated.scene import FINE, FPS, invent


@pytest.fixture(scope="module")
def result():
    return manipulation.measure(lambda done, total, text: None, quick=True)


def test_pulled_tissue_moves_as_the_finite_elements_say(result):
    (row,) = result["rows"]
    # The quick version's elements are coarse, and wrong by their own share.
    assert row["share"] < BOUNDS["share"] + row["elements"]["share"]
    assert row["difference"] < BOUNDS["difference"]
    assert row["rings"]["beyond 3"]["difference"] < 0.08 * row["rings"]["beyond 3"]["motion"]


def test_it_turns_back_when_they_do(result):
    assert abs(result["rows"][0]["late"]) < BOUNDS["late"]


def test_what_is_said_about_it_can_be_drawn_and_read(result):
    assert len(manipulation.draw(result).axes) == 3
    assert "| 5 |" in manipulation.words(result)


@pytest.mark.parametrize("seed", [1, 2])
def test_elements_around_two_grips_are_good_and_their_balls_as_large_on_every_mesh(seed):
    scene = invent(seed)
    grips, volumes = tuple(h.grip for h in scene.holds), []
    for spacing in (0.003, 0.002, 0.0015):
        block = mesh(scene.shape, grips, spacing)
        size = np.linalg.det(np.einsum("mai,gak->mgik", block.points[block.cells], SLOPES))
        assert size.min() > 0.03 * np.median(size)
        volumes.append([ConvexHull(block.points[inside]).volume for inside in block.gripped])
        for grip, inside in zip(grips, block.gripped, strict=True):
            away = np.linalg.norm(block.points - scene.shape.upper(grip.uv), axis=1)
            assert away[~inside].min() > away[inside].max() + 0.1 * spacing
    assert np.allclose(volumes, volumes[-1], rtol=0.03)


def test_a_covariance_of_known_errors_is_found_again():
    scenes, rng = [invent(seed) for seed in range(4)], np.random.default_rng(0)
    made = []
    for scene in scenes:
        clock, points = scene.clock(), scene.shape.upper(scene.probes())
        e = np.zeros((len(clock), len(points), 3))
        for hold in scene.holds:
            away = np.linalg.norm(scene.probes() - hold.grip.uv, axis=1) / hold.grip.radius
            on = (clock >= hold.begin) & (clock <= hold.release)
            reach = np.linalg.norm(hold.path(clock[on]), axis=1)
            apart = np.linalg.norm(points[:, None] - points[None], axis=-1)
            root = np.linalg.cholesky(np.exp(-apart / 0.008) + 1e-9 * np.eye(len(points)))
            e[on] = reach[:, None, None] * (0.02 / (1 + away))[:, None] * (root @ rng.standard_normal((len(points), 3)))
        made.append(e)
    error = model_error(scenes, made)
    assert deviation(error, np.array([0.3, 5.0]), "hold", 0.01) == pytest.approx([0.02e-2 / 1.3, 0.02e-2 / 6], rel=0.4)
    assert error["length"] == pytest.approx(0.008, rel=0.4)
    scene = scenes[0]
    points, center = scene.shape.upper(scene.probes()[::7]), scene.shape.upper(scene.holds[0].grip.uv)
    C = covariance(error, points, center, scene.holds[0].grip.radius, "hold", 0.008)
    assert np.linalg.eigvalsh(C).min() > 0


def test_a_rebound_is_timed_between_two_readings():
    scene = invent(0)
    hold, clock = scene.holds[0], scene.clock() / FPS
    swing = np.cos(2 * np.pi * np.maximum(clock - hold.release / FPS, 0) / 0.06) * 0.004
    run = swing[:, None, None] * (hold.pull / np.linalg.norm(hold.pull)) * np.ones((1, len(scene.probes()), 1))
    time, size = rebound(scene, hold, run)
    assert time == pytest.approx(0.03, abs=0.1 / FINE / FPS)
    assert size == pytest.approx(-0.004, rel=0.02)
