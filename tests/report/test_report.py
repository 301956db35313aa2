"""The page of a run: whole, the same every time, honest, and seen by a real browser."""

import dataclasses
import json
import re
import shutil
import subprocess
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from browser import Browser, installed
from links import dead
from proof import made_up
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
from surgisim.report.board.known import page as known
from surgisim.report.board.page import page as scoreboard
from surgisim.report.charts.fit import descents
from surgisim.report.diagnosed.case import read
from surgisim.report.diagnosed.page import page as diagnosed
from surgisim.report.digits import shown
from surgisim.report.distrust import distrust
from surgisim.report.headline import headline
from surgisim.report.made import commit
from surgisim.report.made import made as how_made
from surgisim.report.moments import moments
from surgisim.report.page import page
from surgisim.report.story import Story
from surgisim.report.thumbnail import thumbnail
from surgisim.report.views import DARKEST, balls, look, surface
from surgisim.skin import skin

ROOT = Path(__file__).parents[2]
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
    assert 'class="best"' in text


def test_the_summary_links_to_where_the_rules_leave_reports(made, tmp_path):
    rules = "".join(path.read_text() for path in (ROOT / "workflow" / "rules").glob("*.smk"))
    assert '"results/{clip}/{variant}/report/report.html"' in rules
    assert '"results/summary.html"' in rules
    metrics = story(made).metrics
    page = tmp_path / "results" / "summary.html"
    page.parent.mkdir()
    page.write_bytes(summary([metrics, dataclasses.replace(metrics, variant="elastic")]))
    assert set(dead(page)) == {
        f"{metrics.clip}/{variant}/report/report.html" for variant in (metrics.variant, "elastic")
    }
    for report in dead(page):
        (page.parent / report).parent.mkdir(parents=True)
        (page.parent / report).touch()
    assert dead(page) == []


def score_with(metrics: Metrics, group: str, name: str, factor: float) -> Metrics:
    entry = metrics.values[group][name]
    changed = entry | {"value": entry["value"] * factor}
    return dataclasses.replace(metrics, values=metrics.values | {group: metrics.values[group] | {name: changed}})


def test_no_value_of_the_smallest_volume_ratio_is_the_best(made):
    metrics = story(made).metrics
    changed = dataclasses.replace(score_with(metrics, "replay", "smallest_det_f", 0.5), variant="elastic")
    row = table([metrics, changed])["made_up"]["replay.smallest_det_f"]
    assert len(set(row["values"].values())) == 2
    assert row["best"] == []


def test_the_summary_shows_each_variant_s_picture_and_material_with_its_interval(made):
    told = story(made)
    physics = {"corotated.E": {"value": 512.0, "unit": "Pa", "low": 433.0, "high": 598.0, "told": True, "protocol": ""}}
    metrics = dataclasses.replace(told.metrics, values=told.metrics.values | {"physics": physics})
    text = summary([metrics], [thumbnail(told)]).decode()
    assert text.count("data:image/jpeg") == 1
    assert re.search(r"Young&#39;s modulus E \(corotated\)</td><td>Pa</td>\s*<td>512<small>433 – 598", text)


def test_a_page_says_how_it_was_made(made, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    told = how_made({"masking": {"margin": 0.125}}, {"masking": "abcdef0123456789"})
    text = page(story(made), told).decode()
    for words in ("2023-11-14 22:13 UTC", told.commit, "numpy", "core", "&#34;margin&#34;: 0.125", "abcdef0123456789"):
        assert words in text


def test_a_commit_is_told_with_changes_and_a_folder_in_another_checkout_has_none(tmp_path):
    run = partial(subprocess.run, check=True, cwd=tmp_path, capture_output=True)
    (tmp_path / "a").write_text("1")
    run(["git", "init", "-q"])
    run(["git", "add", "a"])
    run(["git", "-c", "user.name=a", "-c", "user.email=a@b", "commit", "-qm", "a"])
    assert re.fullmatch(r"[0-9a-f]{12}", commit(tmp_path))
    (tmp_path / "a").write_text("2")
    assert commit(tmp_path).endswith(" with changes")
    (tmp_path / "inside").mkdir()
    assert "no checkout" in commit(tmp_path / "inside")


def test_separate_starts_of_a_fit_are_not_joined():
    steps = [{"round": "start"}, {"round": "start"}]
    steps += [{"round": 0, "iteration": k} for k in (0, 1, 2)] + [{"round": 0, "iteration": k} for k in (0, 1)]
    assert descents(steps) == [slice(0, 1), slice(1, 2), slice(2, 5), slice(5, 7)]


@pytest.mark.slow
def test_every_page_fits_a_narrow_window_and_a_wide_one(made, content, tmp_path):
    if not installed():
        pytest.skip("NO BROWSER: chromium and chromedriver are not installed, so nobody looked at the pages.")
    told = story(made)
    boards = Path(__file__).parents[2] / "docs"
    case = made_up.case(tmp_path / "case", extra=2e-3, told=made_up.diagnosis())
    files = (case / "recording", case / "diagnosis.json", case / "mismatch.npz", case / "physics.json")
    how = how_made({"masking": {"margin": 0.125}})
    both = [told.metrics, dataclasses.replace(told.metrics, variant="elastic")]
    board = json.loads((boards / "blind" / "23112614" / "scoreboard.json").read_text())
    pages = {
        "report": content,
        "summary": summary(both, [thumbnail(told)] * 2, how),
        "diagnosis": diagnosed(read(*files), how),
        "scoreboard": scoreboard(board, how),
        "known": known(json.loads((boards / "known" / "known.json").read_text()), how),
    }
    with Browser() as browser:
        for name, text in pages.items():
            (tmp_path / f"{name}.html").write_bytes(text)
            browser.open((tmp_path / f"{name}.html").as_uri())
            for width in (420, 1280):
                browser.resize(width, 900)
                assert browser.run(WIDER) == [], (name, width)
                browser.run("scrollTo(0, 1500)")
                top, shown = browser.run(STICKY)
                assert (top, shown) == (0, width > 420), (name, width)


WIDER = """
    document.querySelectorAll('details').forEach(d => d.open = true);
    if (document.documentElement.scrollWidth <= innerWidth) return [];
    return [...document.querySelectorAll('body *')]
        .filter(e => e.getBoundingClientRect().right > innerWidth + 1)
        .map(e => e.outerHTML.slice(0, 120)).concat(`${document.documentElement.scrollWidth} px wide`).slice(-4)"""
STICKY = """
    const links = document.querySelector('nav.contents > div');
    return [links.parentElement.getBoundingClientRect().top, getComputedStyle(links).display !== 'none']"""


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
