"""What is named is said in two sentences."""

from types import SimpleNamespace

import numpy as np
import pytest

from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.judgement import REASONS
from surgisim.diagnosis.markers import markers
from surgisim.diagnosis.words import WHY, drawn, instead, nothing, sentence, unbelieved
from surgisim.physics.place import Place

PUSH = Hypothesis("hidden_contact", np.eye(3), 0, Place((-0.022, -0.007, 0.003), 0.003), 0.48, 1.2)
STRANDS = Hypothesis("fibre", np.eye(1), 1, None)


def of(name, value, unit):
    return {name: {"value": value, "low": 0.8 * value, "high": 1.2 * value, "unit": unit}}


def test_one_law_is_said_with_its_place_and_its_number():
    said = sentence([(PUSH, of("force", 0.2, "N"), 7e-4)], 0.93)
    assert "pushes the tissue at 1 (-22, -7, 3 mm) from 0.48 s to 1.2 s (0.7 mm RMS)" in said
    assert "a push there (force = 0.2 N, 0.16 to 0.24) removes 93 %" in said


def test_two_laws_are_both_said():
    said = sentence([(PUSH, of("force", 0.2, "N"), 7e-4), (STRANDS, of("k1", 4e3, "Pa"), 3e-4)], 0.98)
    assert "one direction (0.3 mm RMS)" in said
    assert "strands in that direction (k1 = 4e+03 Pa, 3.2e+03 to 4.8e+03) together remove 98 %" in said
    assert said.count(". ") == 1


def test_places_have_the_numbers_of_their_effects():
    said = sentence([(STRANDS, of("k1", 4e3, "Pa"), 3e-4), (PUSH, of("force", 0.2, "N"), 7e-4)], 0.98)
    assert "at 2 (-22, -7, 3 mm)" in said
    assert "at 2 (-22, -7, 3 mm) from 0.48 s to 1.2 s; a contact" in drawn(PUSH, 2)
    effects = [
        {"term": "fibre", "place": "everywhere"},
        {"term": "hidden_contact", "place": {"center": [-0.022, -0.007, 0.003], "extent": 0.003, "unit": "m"}},
    ]
    clip = SimpleNamespace(rest=np.array([[0.0, 0, 0], [0.01, 0, 0.002]]), until=3, fps=10.0)
    z = np.array([[1.0, 2, 1, 9], [1, 1, 3, 1]])
    second, worst = markers("named", effects, clip, z)
    assert second == {"mark": "2", "of": "hidden_contact"} | effects[1]["place"]
    assert worst == {"mark": "A", "of": "largest misfit", "center": [0.01, 0.0, 0.002], "unit": "m", "time": 0.2}
    assert markers("nothing detectable", [], clip, z) == []


def test_a_number_without_a_unit_is_said_without_one():
    softer = Hypothesis("damage", np.eye(1), 1, None)
    assert "(most = 0.5, 0.4 to 0.6)" in sentence([(softer, of("most", 0.5, "1"), 1e-3)], 1.0)


def test_a_load_is_said_in_grams():
    load = Hypothesis("added_mass", np.eye(1), 1, Place((0.0, 0.0, 0.0), 0.003), 0.6)
    assert "a weight there (mass = 8.6 g, 6.88 to 10.3)" in sentence([(load, of("mass", 8.6e-3, "kg"), 6e-4)], 1.0)


def test_what_a_law_may_be_instead_is_said():
    said = instead([("tether", 0.31), ("fibre", 0.12)])
    assert "tether (probability 0.31) or fibre (probability 0.12)" in said


def test_nothing_found_says_where_later_frames_differ_all_the_same():
    assert nothing(2e-4) == (
        "Simulation and recording differ by no more than noise, camera and discretisation explain. "
        "Effects above 0.2 mm RMS would mostly have been seen."
    )
    said = nothing(2e-4, (1.07, 0.58))
    assert "in those held out by 1.1 mm RMS, where noise makes 0.58." in said
    assert "hold out fewer (split.json)" in said


@pytest.mark.parametrize(
    ("reason", "why"),
    [
        ("little", "it leaves 40 % of what any smooth motion could explain"),
        ("unbacked", "the plain error of the fitted frames does not fall by what it changes"),
        ("ungrasped", "no grip was found in the video"),
        ("loose", "a push follows whatever comes and goes, and this one leaves 40 %"),
        ("refuted", "the frames held out are farther off with it than without"),
        ("beaten", "the same law at a wrong place, or a wrong law, foretells the frames held out better"),
        ("unconfirmed", "this recording cannot confirm it (probability 0.31)"),
    ],
)
def test_why_a_law_is_not_named_is_said(reason, why):
    said = unbelieved(reason, "tool_slip", 0.31, 0.4, "at 3.6 s (release)", [0.013, -0.027, 0.003])
    assert "most of all at A (13, -27, 3 mm) at 3.6 s (release), and tool_slip " in said
    assert f"It is not named, because {why}" in said
    assert said.count(". ") == 1


def test_every_reason_not_to_name_a_law_has_words():
    # What is named or not detectable is said otherwise, and so is a push that draws.
    assert set(REASONS) - {"named", "faint", "drawn"} == set(WHY)
