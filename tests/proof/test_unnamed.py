"""A law without a name is scored by its character and by what it cuts of the held-out error."""

import pytest
from proof.made_up import diagnosis, effect, named
from proof.test_score import scored

from surgisim.phantom.effect import catalogue
from surgisim.phantom.families.hidden import KINDS
from surgisim.proof.board import figures

SAID = {"at_rest": True, "change": "grows", "energy": "gives", "local": True, "period": None}


def residual(before=0.95, after=0.75, helps=True, **said) -> dict:
    law = {key: value for key, value in named("residual_stress").items() if key != "probability"}
    return {
        "laws": [law], "character": {**SAID, **said}, "numbers": 9, "helps": helps, "words": "It grows.",
        "held_out": {"noise_floor": 0.5, "before": before, "after": after, "unit": "mm"},
    }  # fmt: skip


def case(folder, **changed):
    told = diagnosis(verdict="unexplained", residual=residual(**changed))
    return scored(folder, kind="outside", effects=(effect("swelling", outside_catalogue=True),), told=told)


def test_character_and_cut_are_scored_for_what_is_outside_the_catalogue(tmp_path):
    found = case(tmp_path)
    assert found["unnamed"]["character"]
    oracle = found["held_out"]["oracle"]
    assert found["unnamed"]["share"] == pytest.approx(0.2 / (0.95 - oracle))
    assert not found["unnamed"]["rises"]
    assert figures([found])["unnamed_cut"]["value"] == pytest.approx(found["unnamed"]["share"])


def test_one_wrong_answer_is_a_wrong_character(tmp_path):
    found = case(tmp_path, change="holds")["unnamed"]
    assert not found["character"]
    assert found["answered"] == pytest.approx(4 / 5)


def test_what_is_not_modelled_cuts_nothing_and_raises_nothing(tmp_path):
    found = case(tmp_path, after=1.2, helps=False)["unnamed"]
    assert (found["share"], found["rises"], found["modelled"]) == (0.0, False, False)


def test_what_is_in_the_catalogue_has_no_such_score(tmp_path):
    assert scored(tmp_path, told=diagnosis(verdict="unexplained", residual=residual()))["unnamed"] is None


@pytest.mark.parametrize("name", sorted(n for n, e in catalogue().items() if e.outside))
def test_every_effect_outside_the_catalogue_says_its_character(name):
    asked = catalogue()[name].character.right(SAID)
    assert {"at_rest", "change", "local", "periodic"} <= set(asked)


def test_an_effect_of_the_catalogue_has_none():
    assert all(e.character is None for e in catalogue().values() if not e.outside)


def test_families_say_it_too():
    for kind in KINDS.values():
        assert (kind.character is not None) == kind.outside
        assert kind.character is None or kind.character.right(SAID)
