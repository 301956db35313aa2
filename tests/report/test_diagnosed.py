"""The page of a diagnosis: whole for every verdict, and true to what the law's own file says."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import Browser, installed
from proof import made_up
from proof.made_up import diagnosis, named
from proof.test_unnamed import residual

from surgisim.artifacts.verdict import Effect
from surgisim.physics.catalogue import catalogue
from surgisim.problem import Problem
from surgisim.report.diagnosed.case import read
from surgisim.report.diagnosed.goodness import band
from surgisim.report.diagnosed.laws import law, told
from surgisim.report.diagnosed.page import page
from surgisim.report.diagnosed.sides import sides

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


@pytest.mark.parametrize("at", ["at B (30, 30, 20 mm)", "near (30, 30, 20) mm"])
def test_a_pull_in_words_is_drawn(tmp_path, at):
    words = f"Grasp {at}, pull 5 mm up along (0.00, 0.60, 0.80), hold 1.2 s and release: they would differ."
    made = made_up.case(tmp_path, told=diagnosis(effects=(named(separating_experiment=words),)))
    case = read(made / "recording", made / "diagnosis.json", made / "mismatch.npz", made / "physics.json")
    assert case.experiment["center"] == pytest.approx([0.03, 0.03, 0.02])
    assert case.experiment["pull"] == pytest.approx([0.0, 0.003, 0.004])
    assert [(m.mark, m.of) for m in case.markers] == [("1", "stiff_inclusion"), ("B", "the pull that would decide")]


MARKERS = [
    {"mark": "2", "of": "tether", "center": [31.0, 22.0, 14.0], "extent": 7.0, "unit": "mm"},
    {"mark": "A", "of": "largest misfit", "center": [0.028, 0.027, 0.02], "unit": "m", "time": 1.2},
]


def test_places_have_one_number_everywhere_in_the_recordings_frame(tmp_path):
    effects = (named("fibre", place="everywhere"), named("tether"))
    text = shown(tmp_path, diagnosis(effects=effects, markers=MARKERS)).decode()
    rows = [re.findall(r"[^<>\n]+(?=</)", row) for row in re.findall(r"<tr>(.*?)</tr>", text) if 'class="mark' in row]
    assert rows[0] == ["2", "tether", "31.0", "22.0", "14.0", "7.0"]
    assert rows[1] == ["A", "largest misfit", "28.0", "27.0", "20.0", "1.20"]
    assert "2 (31.0, 22.0, 14.0 mm), radius 7.0 mm" in text
    assert "in the recording's own frame" in text


@pytest.mark.parametrize("up", [(0, 0, 1), (0.1, -0.9, 0.2), (0, 0, -1), (-1, 0, 0)])
def test_pictures_have_the_axes_of_the_recording_and_mirror_nothing(tmp_path, up):
    made = made_up.case(tmp_path)
    case = read(made / "recording", made / "diagnosis.json", made / "mismatch.npz", made / "physics.json")
    case = replace(case, recording=replace(case.recording, gravity=tuple(-9.81 * np.array(up))))
    looks = sides(case)
    for name in ("above", "side"):
        view, (across, upward, sign) = looks[name].view, looks[name].axes
        axes = dict(zip("xyz", np.eye(3), strict=True))
        assert (view.right == axes[across]).all()
        assert (view.down == -sign * axes[upward]).all()
        along = axes[looks[name].title[-1]] * (1 if looks[name].title[-2] == "+" else -1)
        assert (np.cross(view.right, view.down) == along).all()
    assert looks["side"].view.down @ up < -0.8
    assert looks["oblique"].axes is None


def test_a_law_without_a_name_is_shown_with_its_character_and_whether_it_predicts(tmp_path):
    for helps, words in (
        (True, "This law and its numbers stand in physics.json"),
        (False, "It is not in physics.json."),
    ):
        told = diagnosis(verdict="unexplained", residual=residual(helps=helps))
        text = shown(tmp_path / str(helps), told).decode()
        for each in (words, "Without a name", "It grows.", "also at rest", "in one place", "S = T w(X) c(t)", "0.750"):
            assert each in text, each


def test_how_well_it_fits_is_shown_where_it_is_told(tmp_path):
    told = {
        "nuisances": [{"name": "tracker_lag", "value": 4.2, "sd": 1.1, "unit": "ms", "said": True}],
        "goodness": {"per_frame": [None, *[1.1] * 23], "degrees": 30},
        "untold": ["nu", "eta"],
    }
    text = shown(tmp_path / "own", diagnosis(**told)).decode()
    for words in ("How well it fits", "tracker lag", "4.20", "Goodness of fit in time", "<b>nu, eta</b>"):
        assert words in text, words
    within = {"goodness": [1.1] * 40, "bounds": ["nu"]}
    text = shown(tmp_path / "test", diagnosis(global_test=within)).decode()
    assert "Goodness of fit in time" in text
    assert "<b>nu</b>" in text
    assert "How well it fits" not in shown(tmp_path / "none", diagnosis()).decode()
    with pytest.raises(Problem, match="has 41 frames, but the recording has 40"):
        shown(tmp_path / "long", diagnosis(goodness=[1.0] * 41))


def test_noise_alone_spreads_as_its_degrees_of_freedom_say(tmp_path):
    made = made_up.case(tmp_path, told=diagnosis(goodness={"per_frame": [1.0] * 24, "degrees": 30}))
    case = read(made / "recording", made / "diagnosis.json", made / "mismatch.npz", made / "physics.json")
    low, high = band(case)
    drawn = (np.random.default_rng(0).standard_normal((20000, 30)) ** 2).mean(1)
    assert (low[0], high[0]) == pytest.approx(np.quantile(drawn, [0.05, 0.95]), abs=0.02)
    assert low[-1] < high[-1]


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


def test_the_page_says_with_which_settings_and_code_it_was_diagnosed(tmp_path):
    told = diagnosis() | {"header": {"settings": {"grid": 0.165}, "code": "abcdef0123456789"}}
    folder = made_up.case(tmp_path, extra=2e-3, told=told)
    case = read(folder / "recording", folder / "diagnosis.json", folder / "mismatch.npz", folder / "physics.json")
    text = page(case, case.made()).decode()
    assert "&#34;grid&#34;: 0.165" in text
    assert "abcdef0123456789" in text
