"""The runner: every case is found, measured, drawn and told."""

import importlib
import json

import pytest

from surgisim.problem import Problem
from surgisim.verification.cases import Absent, Case, absence, cases, choose, data
from surgisim.verification.markdown import table
from surgisim.verification.page import assemble, rounded, run


@pytest.mark.parametrize("name", cases())
def test_every_case_can_be_measured_drawn_and_told(name):
    case = importlib.import_module(f"surgisim.verification.{name}")
    assert case.__doc__
    assert all(callable(getattr(case, part)) for part in ("measure", "draw", "words"))


def test_a_case_leaves_figures_and_a_picture_that_the_page_shows(tmp_path):
    run("free_fall", tmp_path / "verification", quick=True)
    kept = json.loads((tmp_path / "verification" / "free_fall.json").read_text())
    shown = assemble(tmp_path / "verification", tmp_path / "verification.md")
    page = (tmp_path / "verification.md").read_text()
    assert kept["case"] == "free_fall"
    assert kept["quick"]
    assert (tmp_path / "verification" / "free_fall.png").stat().st_size > 5000
    assert shown == ["free_fall"]
    assert all(part in page for part in ("## Free fall", "(verification/free_fall.png)", "small version"))
    assert page.count("Not measured") == len(cases()) - 1


def test_a_case_without_its_data_says_so_in_one_sentence(monkeypatch, tmp_path):
    case = Case("far", "Far away", "nowhere")
    monkeypatch.delenv("SURGISIM_DATA", raising=False)
    assert "SURGISIM_DATA is not set" in absence(case)
    monkeypatch.setenv("SURGISIM_DATA", str(tmp_path))
    assert "no such folder" in absence(case)
    with pytest.raises(Absent):
        data("nowhere")
    (tmp_path / "nowhere").mkdir()
    assert absence(case) is None
    assert data("nowhere") == tmp_path / "nowhere"


def test_a_case_that_does_not_exist_is_refused():
    with pytest.raises(Problem, match="no case is called"):
        choose(["perpetual_motion"])


def test_figures_are_kept_at_six_digits_and_what_is_no_number_as_null():
    assert rounded({1: [0.123456789, float("nan")], "n": (2, True)}) == {"1": [0.123457, None], "n": [2, True]}


def test_a_table_is_markdown():
    assert table(["a", "b"], [["x", 0.123456]]) == "| a | b |\n| --- | --- |\n| x | 0.123 |\n"
