"""The page of a run: whole, the same every time, honest, and seen by a real browser."""

import dataclasses
import re
import shutil

import numpy as np
import pytest
from browser import Browser, installed
from report.made_up import invent
from slab import slab

from surgisim.artifacts.metrics import Metrics
from surgisim.artifacts.motion import Motion
from surgisim.config.report import Report
from surgisim.measure.run import Run
from surgisim.measure.score import score
from surgisim.measure.truth_seen import seen
from surgisim.report.across import page as summary
from surgisim.report.across import table
from surgisim.report.digits import shown
from surgisim.report.distrust import distrust
from surgisim.report.headline import headline
from surgisim.report.moments import moments
from surgisim.report.page import page
from surgisim.report.story import Story
from surgisim.report.views import DARKEST, balls, look, surface
from surgisim.skin import skin

COST = {"masking": {"seconds": 12.5, "peak_mb": 345.0}, "depth": {"seconds": 3.0}}
LOST = Motion(np.zeros((0, 3)), np.zeros(0), np.zeros((0, 12, 3)), np.zeros((0, 12), bool), np.zeros(0), "none")
NAMES = [f.name for f in dataclasses.fields(Run) if f.name not in ("truth", "found")]


def story(made, **changed) -> Story:
    made = made | changed
    truth = made["truth"] and seen(made["truth"], made["camera"])
    run = Run(**{n: made[n] for n in NAMES}, truth=truth)
    metrics = Metrics("made_up", "main", score(run, lpips=None, first=4), COST)
    return Story(run, made["material"], metrics, Report(panel=120, cell=96))


@pytest.fixture(scope="module")
def made():
    return invent((40, 48), 12, 0)


@pytest.fixture(scope="module")
def content(made) -> bytes:
    return page(story(made))


def test_the_page_needs_nothing_beside_itself(content):
    text = content.decode()
    links = re.findall(r"""(?:src|href|url\()\s*=?\s*["'(]?([^"')\s>]+)""", text)
    assert all(link.startswith(("data:", "#")) for link in links), [
        k for k in links if not k.startswith(("data:", "#"))
    ]
    assert "<script" not in text
    assert len(content) < 8e6


def test_the_same_run_gives_the_same_page(made, content):
    assert page(story(made)) == content


def test_numbers_are_shown_with_the_digits_that_matter():
    texts = [shown(v) for v in (0, 33.567, 3.14159, 1234.5, 0.1234, 0.03, 0.00045, 2.3e-6, 4.2e7, 9.996)]
    assert texts == ["0", "33.6", "3.14", "1,234", "0.123", "0.030", "0.00045", "2.3e-06", "4.2e+07", "10.00"]


def test_a_good_run_has_no_serious_doubt_about_its_replay(made):
    assert not any("replay" in d.sentence.lower() for d in distrust(story(made)) if d.serious)


def test_a_bad_run_says_what_is_wrong(made):
    torn = dataclasses.replace(made["replay"], smallest_volume_ratio=np.full(12, -0.2), nodes=0 * made["replay"].nodes)
    unsure = dataclasses.replace(made["masks"], confidence=np.full(12, 0.2, np.float32))
    told = story(made, motion=LOST, replay=torn, masks=unsure, truth=None)
    sentences = " ".join(d.sentence for d in distrust(told) if d.serious)
    for words in ("No grasp was found", "does not stay whole", "outline is unsure"):
        assert words in sentences
    assert {c.title: c.mark for c in headline(told)}["Replay's body"] == "poor"


def test_a_replay_that_was_not_drawn_still_has_a_page_and_no_name_becomes_markup(made):
    blind = dataclasses.replace(made["replay"], rgb=made["replay"].rgb[:0])
    told = story(made, replay=blind, motion=LOST, truth=None)
    named = dataclasses.replace(told, metrics=dataclasses.replace(told.metrics, clip="<script>alert(1)</script>"))
    text = page(named).decode()
    assert "replay was not rendered" in text
    assert "<script" not in text


def test_the_moments_hold_the_rest_the_farthest_pull_and_the_end(made):
    chosen = moments(made["motion"], 5)
    way = np.linalg.norm(made["motion"].position[0] - made["motion"].center_rest[0], axis=-1)
    assert len(set(chosen)) == 5
    assert {0, int(np.argmax(way * made["motion"].active[0])), 11} <= set(chosen)


def test_the_nearer_ball_hides_the_farther_one():
    points = np.array([[0, 0, 0.1], [0, 0, 0.2], [0.05, 0, 0.1]])
    view = look(points, 0, 0, (60, 40))
    picture = balls(points, np.array([[255.0, 0, 0], [0, 0, 255], [0, 255, 0]]), 0.01, view)
    pixels, _ = view.place(points)
    x, y = np.rint(pixels[0]).astype(int)
    assert picture[y, x].argmax() == 0
    assert not (picture.reshape(-1, 3).argmax(1) == 2).any() or picture.min() == 0


@pytest.mark.parametrize("yaw", [0, 30, 60])
def test_the_nearer_side_of_a_closed_surface_hides_the_farther_one(yaw):
    """A box whose front is red and whose back is blue, as bright as its front faces who looks."""
    body = slab()
    red, blue = [200.0, 0, 0], [0, 0, 200.0]
    color = np.where((body.rest[:, 2] < 0.0685)[:, None], red, blue)
    view = look(body.rest.astype(float), yaw, 0, (120, 90))
    picture = surface(body.rest, skin(body), color, view)
    front = np.array([[0.0, 0.0, body.rest[:, 2].min()]])
    x, y = np.rint(view.place(front)[0][0]).astype(int)
    bright = DARKEST + (1 - DARKEST) * np.cos(np.radians(yaw))
    assert picture[y, x] == pytest.approx([200 * bright, 0, 0], abs=4)
    assert (picture[0, 0] == 255).all()
    # Without holes: in each row nothing is white between what is tissue.
    tissue = (picture < 255).any(2)
    for row in tissue[tissue.any(1)]:
        assert row[np.flatnonzero(row)[0] : np.flatnonzero(row)[-1] + 1].all()


def test_the_summary_marks_the_best_of_a_row(made):
    metrics = story(made).metrics
    worse = score_with(metrics, "simulation", "true_held_out", 2.0)
    runs = [metrics, dataclasses.replace(worse, variant="elastic")]
    row = table(runs)["made_up"]["simulation.true_held_out"]
    assert row["best"] == ["main"]
    assert table(runs)["made_up"]["masking.tool_iou"]["best"] == []
    text = summary(runs).decode()
    assert "elastic/report/report.html" in text
    assert 'class="best"' in text


def score_with(metrics: Metrics, group: str, name: str, factor: float) -> Metrics:
    entry = metrics.values[group][name]
    changed = entry | {"value": entry["value"] * factor}
    return dataclasses.replace(metrics, values=metrics.values | {group: metrics.values[group] | {name: changed}})


@pytest.mark.slow
def test_a_browser_shows_every_picture_and_plays_every_film(content, tmp_path):
    if not installed():
        pytest.skip("NO BROWSER: chromium and chromedriver are not installed, so nobody looked at the report.")
    (tmp_path / "report.html").write_bytes(content)
    with Browser() as browser:
        browser.open((tmp_path / "report.html").as_uri())
        pictures = browser.run(
            "await Promise.all([...document.images].map(i => i.decode()));"
            "return [...document.images].filter(i => !(i.naturalWidth > 0)).map(i => i.alt)"
        )
        films = browser.run(
            "const all = [...document.querySelectorAll('video')];"
            "return Promise.all(all.map(async v => { v.currentTime = 0; await v.play();"
            "  const begun = performance.now();"
            "  while (!(v.currentTime > 0) && performance.now() - begun < 8000)"
            "    await new Promise(r => setTimeout(r, 50));"
            "  return [v.readyState, v.currentTime, v.error && v.error.message]; }))"
        )
        wide = browser.run("return [document.documentElement.scrollWidth, innerWidth]")
        complaints = browser.log()
    assert pictures == []
    assert len(films) == 3
    assert all(ready >= 2 and time > 0 and error is None for ready, time, error in films), films
    assert wide[0] <= wide[1]
    assert complaints == []


def test_chromium_is_looked_for_under_its_own_name(monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert not installed()
