"""What counts as right, how far off is measured, and that nothing is opened whose seal does not hold."""

import dataclasses
import json

import numpy as np
import pytest
from proof import made_up
from proof.made_up import diagnosis, effect, named

from surgisim.artifacts.base import load
from surgisim.artifacts.mismatch import Mismatch
from surgisim.artifacts.verdict import read_verdict
from surgisim.problem import Problem
from surgisim.proof.case import score
from surgisim.proof.held_out import rms
from surgisim.proof.truth import opened
from surgisim.recordings.folder import read_recording

CELL = 0.003


def unsealed(folder, **changed):
    seal = (folder / "seal.txt").read_text()
    files = {
        "truth": (folder / "sealed/truth.json").read_bytes(),
        "tracks": (folder / "sealed/truth.npz").read_bytes(),
        "salt": (folder / "sealed/salt.txt").read_text(),
        "seal": seal,
        "published": f"0 {seal}\n",
    }
    return opened(**(files | changed))


def scored(folder, **case):
    made_up.case(folder, **case)
    verdict, left = read_verdict(folder / "diagnosis.json"), load(Mismatch, folder / "mismatch.npz")
    return score(unsealed(folder), read_recording(folder / "recording"), verdict, left, CELL)


def test_a_law_named_rightly_is_right_placed_and_measured(tmp_path):
    found = scored(tmp_path)
    assert (found["top1"], found["top2"], found["abstained"]) == (True, True, False)
    assert found["places"][0]["error_mm"] == pytest.approx(3.0)
    assert found["places"][0]["cells"] == pytest.approx(1.0)
    assert found["places"][0]["right"]
    (row,) = found["parameters"]
    assert (row["name"], row["true"], row["value"], row["covered"]) == ("s", 4.0, 4.4, True)
    assert row["relative"] == pytest.approx(0.1)
    assert found["phases"] == ["rest", "load", "hold", "release"]


def test_the_second_name_counts_for_the_first_two_only(tmp_path):
    told = diagnosis(effects=(named("tether", 0.6, runners_up=[{"term": "stiff_inclusion", "probability": 0.3}]),))
    found = scored(tmp_path, told=told)
    assert (found["top1"], found["top2"], found["probability_of_truth"]) == (False, True, 0.3)
    assert found["places"] == found["parameters"] == []


def test_who_names_nothing_is_not_right_whatever_the_ranking(tmp_path):
    found = scored(tmp_path, told=diagnosis(verdict="unexplained"))
    assert (found["top1"], found["top2"], found["ranked_first"], found["abstained"]) == (False, False, True, True)


def test_the_engines_viscosity_is_the_phantoms_damping(tmp_path):
    hidden = effect("damping", parameters={"eta": {"value": 20.0, "unit": "Pa s"}})
    told = diagnosis(effects=(named("newtonian", parameters={"eta": {"value": 18.0, "unit": "Pa s"}}),))
    found = scored(tmp_path, effects=(hidden,), told=told)
    assert found["top1"]
    assert found["parameters"][0]["relative"] == pytest.approx(-0.1)


def test_a_relaxing_branch_is_compared_by_its_modulus(tmp_path):
    numbers = {"g": {"value": 0.5, "unit": "1"}, "tau": {"value": 0.4, "unit": "s"}}
    hidden = effect("relaxation", place="everywhere", parameters=numbers)
    fitted = {"G": {"value": 0.5 * 3000 / 2.9, "low": 1.0, "high": 2.0, "unit": "Pa"}}
    found = scored(tmp_path, effects=(hidden,), told=diagnosis(effects=(named("relaxation", parameters=fitted),)))
    assert found["parameters"][0]["relative"] == pytest.approx(0, abs=1e-12)
    assert not found["parameters"][0]["covered"]
    assert found["places"] == []


def test_a_local_law_said_to_be_everywhere_is_not_placed(tmp_path):
    found = scored(tmp_path, told=diagnosis(effects=(named(place="everywhere"),)))
    assert found["top1"]
    assert found["places"] == [
        {"term": "stiff_inclusion", "error_mm": None, "cells": None, "extent_ratio": None, "right": False}
    ]


def test_an_onset_is_off_by_frames(tmp_path):
    hidden = effect("hidden_contact", time={"onset": 0.8, "end": 1.2})
    told = diagnosis(effects=(named("hidden_contact", time={"onset": 1.1, "end": 1.2}),))
    assert scored(tmp_path, effects=(hidden,), told=told)["onsets"][0]["frames"] == pytest.approx(3.0)


@pytest.mark.parametrize(("verdict", "wrong"), [("nothing detectable", False), ("unexplained", False), ("named", True)])
def test_only_a_name_where_nothing_is_concealed_is_a_false_discovery(tmp_path, verdict, wrong):
    found = scored(tmp_path, kind="nothing", effects=(), snr=0.0, extra=0.0, told=diagnosis(verdict=verdict))
    assert found["false_discovery"] is wrong
    assert found["top1"] is None


@pytest.mark.parametrize(
    ("told", "held"),
    [
        (diagnosis(verdict="unexplained"), True),
        (diagnosis(effects=(named("fibre", 0.4),)), True),
        (diagnosis(effects=(named("fibre", 0.6),)), False),
        (diagnosis(verdict="nothing detectable"), False),
    ],
)
def test_what_no_catalogue_has_should_be_called_unexplained_or_be_doubted(tmp_path, told, held):
    hidden = effect("swelling", outside_catalogue=True)
    assert scored(tmp_path, kind="outside", effects=(hidden,), told=told)["held_back"] is held


def test_of_two_laws_one_is_right_and_both_are_better(tmp_path):
    hidden = (effect(), effect("relaxation", place="everywhere", parameters={}))
    one = scored(tmp_path / "one", kind="two", effects=hidden)
    both = scored(tmp_path / "two", kind="two", effects=hidden, told=diagnosis(effects=(named(), named("relaxation"))))
    assert (one["top1"], one["both"], both["both"]) == (True, False, True)


def test_a_second_name_that_is_not_concealed_is_a_wrong_name(tmp_path):
    more = diagnosis(effects=(named(), named("fibre", 0.6)))
    assert scored(tmp_path / "more", told=more)["wrong_names"] == [False, True]
    class_ = diagnosis(verdict="equivalence class", effects=(named("tether", 0.5), named("stiff_inclusion", 0.4)))
    found = scored(tmp_path / "class", told=class_)
    assert (found["top1"], found["top2"], found["wrong_names"], found["class_holds"]) == (False, True, [False], True)


def test_the_cut_is_measured_against_the_noise_floor(tmp_path):
    errors = scored(tmp_path, extra=3e-3, left=0.1)["held_out"]
    assert errors["source"] == "mismatch.npz"
    assert errors["oracle"] == errors["noise_floor"] < errors["after"] < errors["before"]
    # A tenth of the effect is left: beside the noise, hardly more.
    assert 0.93 < errors["share"] < 1
    assert errors["before"] == pytest.approx(errors["oracle_before"], rel=1e-4)


@pytest.mark.parametrize(("less", "better"), [(0.0, False), (1e-6, False), (1e-4, True), (-1e-4, False)])
def test_a_placebo_is_better_by_whatever_single_precision_tells(tmp_path, less, better):
    errors = {"noise_floor": 0.5, "before": 0.95, "after": 0.57, "placebo": 0.57 - less, "unit": "mm"}
    assert scored(tmp_path, told=diagnosis(held_out=errors))["held_out"]["placebo_better"] is better


def test_a_points_constant_offset_is_no_error_but_what_stays_after_a_pull_is():
    away = np.random.default_rng(0).normal(size=(5, 90, 3))
    away[1, 4] = np.nan
    parts = slice(0, 30), slice(60, 90)
    offset, stays = np.arange(5)[:, None, None], 2.0 * (np.arange(90) > 45)[None, :, None]
    plain = rms(away, *parts)
    assert rms(away + offset, *parts) == pytest.approx(plain)
    assert rms(away + stays, *parts) == pytest.approx(np.hypot(plain, 2e3 * 3**0.5), rel=0.05)


def test_a_diagnosis_of_fewer_points_is_scored_on_those(tmp_path):
    made_up.case(tmp_path, extra=3e-3)
    left = load(Mismatch, tmp_path / "mismatch.npz")
    names = ("points", "residual_before", "residual_after", "z")
    few = dataclasses.replace(left, **{name: getattr(left, name)[3:] for name in names})
    verdict, recording = read_verdict(tmp_path / "diagnosis.json"), read_recording(tmp_path / "recording")
    some, whole = (score(unsealed(tmp_path), recording, verdict, m, CELL)["held_out"] for m in (few, left))
    assert some["oracle"] != whole["oracle"]
    assert some["before"] == pytest.approx(some["oracle_before"], rel=1e-4)


def test_another_truth_is_not_opened(tmp_path):
    made_up.case(tmp_path)
    changed = (tmp_path / "sealed/truth.json").read_bytes().replace(b"stiff_inclusion", b"tether_inclusio")
    with pytest.raises(Problem, match="does not have the seal"):
        unsealed(tmp_path, truth=changed)


def test_a_seal_that_was_not_published_before_is_refused(tmp_path):
    made_up.case(tmp_path)
    with pytest.raises(Problem, match="not in the log of seals"):
        unsealed(tmp_path, published="0 " + 64 * "0")


def test_other_noise_free_paths_are_refused(tmp_path):
    made_up.case(tmp_path)
    with pytest.raises(Problem, match=r"truth\.npz is not the file"):
        unsealed(tmp_path, tracks=made_up.npz(plain=np.zeros(3), true=np.zeros(3)))


def test_files_of_two_cases_are_not_scored_together(tmp_path):
    with pytest.raises(Problem, match="Score files of one case"):
        scored(tmp_path, told=diagnosis("r-other"))


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"format": "other/1"}, "its format is"),
        ({"verdict": "sure"}, "'verdict' is 'sure'"),
        ({"effects": []}, "no effect is given"),
        ({"effects": [named(probability=1.4)]}, "a number from 0 to 1"),
        ({"effects": [named(place={"center": [0, 1], "unit": "m"})]}, "three numbers"),
        ({"detectable_above": {"value": 1, "unit": "inch"}}, "'m' or 'mm'"),
    ],
)
def test_a_diagnosis_that_could_be_misread_is_refused(tmp_path, changed, words):
    path = tmp_path / "diagnosis.json"
    path.write_text(json.dumps(diagnosis() | changed))
    with pytest.raises(Problem, match=words):
        read_verdict(path)


def test_a_place_in_millimetres_is_read_as_metres(tmp_path):
    path = tmp_path / "diagnosis.json"
    place = {"center": [31.0, 22.0, 14.0], "extent": 7.0, "unit": "mm"}
    path.write_text(json.dumps(diagnosis(effects=(named(place=place),))))
    (found,) = read_verdict(path).effects
    assert found.center == pytest.approx((0.031, 0.022, 0.014))
    assert found.extent == pytest.approx(0.007)
