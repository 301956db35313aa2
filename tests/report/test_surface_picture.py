"""The picture of a scene's surface shows what its numbers say."""

from dataclasses import fields, replace

import cv2
import numpy as np
import pytest
from matplotlib.figure import Figure
from report.made_up import invent

from surgisim.measure.groups import scene_geometry as geometry
from surgisim.measure.run import Run
from surgisim.report.charts import surface as chart

BLUE = [int(chart.TURNED[i : i + 2], 16) for i in (1, 3, 5)]


@pytest.fixture(scope="module")
def run():
    made = invent((40, 48), 8, 0)
    return Run(**{f.name: made[f.name] for f in fields(Run) if f.name not in ("truth", "found")})


def blue(run) -> float:
    """Share of the picture that is shown as turned over."""
    picture = cv2.imdecode(np.frombuffer(chart.surface(run, "a clip"), np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    return float((picture == BLUE).all(-1).mean())


def test_what_is_turned_over_is_blue_and_nothing_else(run, monkeypatch):
    assert blue(run) == 0
    monkeypatch.setattr(geometry, "displace", lambda points, field, time: points * ([-1, 1, 1] if time else [1, 1, 1]))
    assert blue(run) > 0.2


def test_the_same_scene_gives_the_same_picture(run):
    assert chart.surface(run, "a") == chart.surface(run, "a")


def test_a_scene_without_a_surface_says_so_and_ends_well(run):
    clear = replace(run, scene=replace(run.scene, opacity=np.full_like(run.scene.opacity, -9.0)))
    assert geometry.surface_moved(clear) is None
    assert blue(clear) == 0


def test_splats_are_drawn_as_long_and_as_turned_as_they_are(run):
    """Four times as long as wide, along the picture's diagonal; one lies in the middle, one outside the window."""
    camera, quarter = run.camera, np.pi / 8
    one = replace(
        run.scene,
        mean=np.array([[0.0, 0.0, 0.1], [0.05, 0.0, 0.1]], np.float32),
        rotation=np.array([[np.cos(quarter), 0, 0, np.sin(quarter)]] * 2, np.float32),
        scale=np.log(np.array([[4e-3, 1e-3, 1e-3]] * 2, np.float32)),
        opacity=np.full(2, 9.0, np.float32),
        color=np.zeros((2, 3), np.float32),
    )
    axes = Figure().subplots()
    chart._splats(axes, one, camera, camera.project(one.mean.astype(float))[0])
    ellipses = axes.collections[0]
    assert ellipses.get_widths() == pytest.approx(8e-3 * camera.fx / 0.1, rel=1e-3)
    assert ellipses.get_heights() == pytest.approx(2e-3 * camera.fx / 0.1, rel=1e-3)
    assert np.mod(ellipses.get_angles(), 180) == pytest.approx(45, abs=0.1)
