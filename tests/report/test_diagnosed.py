"""The page of a diagnosis: whole for every verdict, and true to what the law's own file says."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from proof import made_up
from proof.made_up import diagnosis, named
from report.browser import Browser, installed

from surgisim.artifacts.verdict import Effect
from surgisim.physics.catalogue import catalogue
from surgisim.problem import Problem
from surgisim.report.diagnosed.case import read
from surgisim.report.diagnosed.laws import law, told
from surgisim.report.diagnosed.page import page

EXPERIMENT = {"center": [0.03, 0.03, 0.02], "pull": [0.0, 0.004, 0.007]}
VERDICTS = {
    "named": diagnosis(experiment=EXPERIMENT),
    "equivalence class": diagnosis(verdict="equivalence class", effects=(named(), named("tether", 0.4))),
    "nothing detectable": diagnosis(verdict="nothing detectable", ranking=[]),
    "unexplained": diagnosis(verdict="unexplained"),
    "bare": {
        "format": "surgisim-diagnosis/1", "recording": "r-made", "verdict": "named",
        "effects": [{"term": "fibre", "probability": 0.6, "place": "everywhere"}],
    },
}  # fmt: skip


def shown(folder, told) -> bytes:
    made = made_up.case(folder, extra=2e-3, told=told)
    return page(read(made / "recording", made / "diagnosis.json", made / "mismatch.npz", made / "physics.json"))


@pytest.fixture(scope="module", params=list(VERDICTS))
def content(request, tmp_path_factory) -> tuple[str, str]:
    return request.param, shown(tmp_path_factory.mktemp("page"), VERDICTS[request.param]).decode()


def test_every_verdict_has_a_page_that_needs_nothing_beside_it(content):
    _, text = content
    links = re.findall(r"""(?:src|href)="([^"]+)""", text)
    assert all(link.startswith(("data:", "#")) for link in links)
    assert "<script" not in text
    assert len(text) < 4e6


def test_the_title_says_what_was_left_out_or_that_nothing_was_found(content):
    name, text = content
    title = re.search(r"<title>r-made: (.*?)</title>", text).group(1)
    assert (
        title
        == {
            "named": "stiff inclusion",
            "equivalence class": "stiff inclusion or tether",
            "nothing detectable": "nothing found",
            "unexplained": "something that no law here explains",
            "bare": "fibre",
        }[name]
    )


def test_the_named_law_is_shown_with_its_equation_and_numbers(tmp_path):
    text = shown(tmp_path, VERDICTS["named"]).decode()
    for words in (
        "s(x) = 1 + (s - 1) exp(",
        "Eshelby",
        "3.50 to 5.60",
        "radius 7.0 mm",
        "To decide:",
        "Pull the tissue",
    ):
        assert words in text, words


def test_a_pull_in_words_is_drawn(tmp_path):
    words = (
        "Grasp near (30, 30, 20) mm, pull 5 mm up along (0.00, 0.60, 0.80), hold 1.2 s and release: they would differ."
    )
    made = made_up.case(tmp_path, told=diagnosis(effects=(named(separating_experiment=words),)))
    found = read(made / "recording", made / "diagnosis.json", made / "mismatch.npz", made / "physics.json").experiment
    assert found["center"] == pytest.approx([0.03, 0.03, 0.02])
    assert found["pull"] == pytest.approx([0.0, 0.003, 0.004])


def test_held_out_frames_are_marked_also_where_no_split_was_given(tmp_path):
    made = made_up.case(tmp_path, extra=2e-3, told=VERDICTS["named"])
    case = read(made / "recording", made / "diagnosis.json", made / "mismatch.npz", made / "physics.json")
    motion = case.recording.motion
    for begins, anew in ((0, False), (case.recording.held_out[0], True)):
        active = np.broadcast_to(np.arange(case.recording.frames) >= begins, motion.active.shape)
        grasped = replace(case, recording=replace(case.recording, motion=replace(motion, active=active)))
        assert (b"tissue is grasped anew" in page(grasped)) == anew
    case = replace(case, recording=replace(case.recording, split=None))
    until = case.recording.fitted_until
    assert 0 < until < case.recording.frames
    assert case.split.tolist() == [0] * until + [2] * (case.recording.frames - until)


def test_nothing_found_leaves_nothing_unexplained(tmp_path):
    assert "Left unexplained" in shown(tmp_path / "a", VERDICTS["unexplained"]).decode()
    assert "Left unexplained" not in shown(tmp_path / "b", VERDICTS["nothing detectable"]).decode()


def test_names_do_not_become_markup(tmp_path):
    text = shown(tmp_path, diagnosis(words="<script>alert(1)</script>")).decode()
    assert "<script" not in text


@pytest.mark.parametrize("name", sorted(catalogue()))
def test_every_law_can_be_shown_from_its_own_file(name):
    about = catalogue()[name].about
    title, equation, words, source = told(about)
    assert title
    assert title == about.strip().splitlines()[0]
    letters = re.sub(r"\s", "", title + equation + words + source)
    assert sorted(letters) == sorted(re.sub(r"\s", "", about))
    assert law(Effect(name, 1.0)).place == "everywhere"


def test_files_of_two_diagnoses_are_not_shown_together(tmp_path):
    with pytest.raises(Problem, match="Pass files of one diagnosis"):
        shown(tmp_path, diagnosis("r-other"))


@pytest.mark.slow
def test_a_browser_shows_every_picture_of_a_diagnosis(tmp_path):
    if not installed():
        pytest.skip("NO BROWSER: chromium and chromedriver are not installed, so nobody looked at the page.")
    (tmp_path / "page.html").write_bytes(shown(tmp_path, VERDICTS["named"]))
    with Browser() as browser:
        browser.open((tmp_path / "page.html").as_uri())
        broken = browser.run(
            "await Promise.all([...document.images].map(i => i.decode()));"
            "return [...document.images].filter(i => !(i.naturalWidth > 0)).map(i => i.alt)"
        )
        count = browser.run("return document.images.length")
        wide = browser.run("return [document.documentElement.scrollWidth, innerWidth]")
        complaints = browser.log()
    assert broken == complaints == []
    assert count == 8
    assert wide[0] <= wide[1]


def test_the_stage_writes_the_page(tmp_path):
    made = made_up.case(tmp_path)
    flags = [f for n in ("diagnosis.json", "mismatch.npz", "physics.json") for f in (f"--{n.split('.')[0]}", made / n)]
    command = [sys.executable, Path(__file__).parents[2] / "stages" / "diagnosis_report.py", *flags]
    command += ["--recording", made / "recording", "--page", made / "diagnosis.html"]
    assert subprocess.run(list(map(str, command)), timeout=120).returncode == 0
    assert json.loads((made / "diagnosis.json").read_text())["words"][:20] in (made / "diagnosis.html").read_text()
