"""A base that another recording told is what is known of a body beforehand."""

import json
from dataclasses import replace

import numpy as np
import pytest
from planted import case_of, recording

from surgisim.artifacts.base import encoded
from surgisim.artifacts.physics import Physics
from surgisim.diagnosis import ring_down
from surgisim.diagnosis.elsewhere import known_from, read_elsewhere, words
from surgisim.diagnosis.model import base_numbers
from surgisim.diagnosis.prior import SPREAD, START, SUREST, SUREST_RATIO, prior_of
from surgisim.problem import Problem

TOLD = {
    "neo_hookean_ciarlet": {
        "E": {"value": 2.5e3, "unit": "Pa", "low": 2e3, "high": 3e3},
        "nu": {"value": 0.44, "unit": "1", "low": 0.42, "high": 0.46},
    },
    "newtonian": {"eta": {"value": 10.0, "unit": "Pa s", "low": 5.0, "high": 20.0}},
}
RATIO = {"eta / E": {"value": 4e-3, "low": 3e-3, "high": 5e-3, "unit": "s"}}


def file(path, terms=None, density=1050.0, **more):
    made = Physics(terms or TOLD, density, [0.0] * 3, {"spacing": 2e-3, "step": 1e-4}, **more)
    path.write_bytes(encoded(made, producer="diagnosis", settings={}, code=""))
    return path


def changed(law, name, **entry):
    terms = json.loads(json.dumps(TOLD))
    terms[law][name] |= entry
    return terms


def test_its_intervals_become_middle_and_spread_of_the_prior(tmp_path):
    told = read_elsewhere(file(tmp_path / "a.json", ratios=RATIO))
    prior = prior_of(known_from(recording(), told))
    assert np.exp(prior.middle[0]) == pytest.approx(np.sqrt(6.0) * 1e3)
    assert prior.spread[0] == pytest.approx(max(np.log(1.5) / 3.29, SUREST))
    assert prior.middle[1] == pytest.approx(0.44)
    assert prior.spread[1] == pytest.approx(max(0.04 / 3.29, SUREST_RATIO))
    assert np.exp(prior.middle[2]) == pytest.approx(np.sqrt(15e-6))
    assert "E, nu and eta / E" in words(told, ["E"])
    assert "adds little to E." in words(told, ["E"])


def test_viscosity_over_modulus_is_as_sure_as_both_together_where_the_file_does_not_say(tmp_path):
    low, high = read_elsewhere(file(tmp_path / "a.json")).spans["eta / E"]
    assert np.sqrt(low * high) == pytest.approx(np.sqrt(100.0 / 6e6))
    assert np.log(high / low) / 2 == pytest.approx(np.hypot(np.log(1.5) / 2, np.log(4) / 2))


def test_numbers_that_were_not_told_stay_as_any_tissues(tmp_path):
    terms = changed("neo_hookean_ciarlet", "E", identifiable=False)
    terms["newtonian"]["eta"] = {"value": 10.0, "unit": "Pa s"}
    terms["relaxation"] = {"G": {"value": 100.0, "unit": "Pa"}, "tau": {"value": 1.0, "unit": "s"}}
    told = read_elsewhere(file(tmp_path / "a.json", terms))
    assert set(told.spans) == {"nu"}
    assert "relaxation" in words(told, [])
    prior = prior_of(known_from(recording(), told))
    assert prior.middle[[0, 2]] == pytest.approx(START[[0, 2]])
    assert prior.spread[[0, 2]] == pytest.approx(SPREAD[[0, 2]])


@pytest.mark.parametrize(
    ("terms", "more", "said"),
    [
        (changed("neo_hookean_ciarlet", "E", unit="kPa"), {}, "E is in 'kPa', but 'Pa' is wanted"),
        (changed("neo_hookean_ciarlet", "E", low=2.0, high=3.0), {}, "Is it in another unit?"),
        (changed("newtonian", "eta", low=20.0, high=5.0), {}, "eta is said to lie from 20.0 to 5.0"),
        ({"newtonian": TOLD["newtonian"]}, {}, "has a modulus E and a ratio nu"),
        ({"corotated": {"E": {"value": 1e3, "unit": "Pa"}, "nu": {"value": 0.4, "unit": "1"}}}, {}, "no 90 % interval"),
        (None, {"density": 1.05}, "its density is 1050 kg/m^3, but that of the base in a.json is 1.05"),
    ],
)
def test_a_base_in_another_unit_or_without_intervals_is_refused(tmp_path, terms, more, said):
    with pytest.raises(Problem, match=said.replace("^", r"\^")):
        known_from(recording(), read_elsewhere(file(tmp_path / "a.json", terms, **more)))


def test_what_is_no_physics_json_is_refused(tmp_path):
    (tmp_path / "b.json").write_text("{}")
    for name, said in (("b.json", "has no header"), ("c.json", "no such file")):
        with pytest.raises(Problem, match=said):
            read_elsewhere(tmp_path / name)


def test_a_valley_that_only_the_given_base_rules_out_is_ruled_out_by_it():
    soft, stiff = (START + by * np.eye(3)[0] for by in (-1.0, 1.0))
    ends = [ring_down.Descent(soft, None, 100.0), ring_down.Descent(stiff, None, 116.0, owed=16.0)]
    assert (ring_down.aside(ends)[:, 0] > 0).mean() < 0.01
    ends[1].owed = 0.0
    assert (ring_down.aside(ends)[:, 0] > 0).mean() > 0.2


@pytest.mark.slow
def test_a_clip_too_weak_to_tell_the_modulus_keeps_the_given_interval(tmp_path):
    told = read_elsewhere(file(tmp_path / "a.json", ratios=RATIO))
    # Nothing is let go in the frames that are fitted.
    weak = replace(recording(), split={"fit": (0, 16), "held_out": (16, 32)})
    case = case_of(known_from(weak, told), model_error=0)
    E = base_numbers(case.base)["E"]
    assert E["low"] == pytest.approx(2e3, rel=0.12)
    assert E["high"] == pytest.approx(3e3, rel=0.12)
    assert "E" in case.base.as_given


def test_the_base_without_what_was_named_beside_it_is_handed_on(tmp_path):
    terms = changed("neo_hookean_ciarlet", "E", value=1.5e3, low=1e3, high=2e3)
    terms["stiffening"] = {"k": {"value": 2e4, "unit": "Pa"}}
    alone = {"E": TOLD["neo_hookean_ciarlet"]["E"], "nu": {"value": 0.45, "unit": "1"}, **RATIO}
    told = read_elsewhere(file(tmp_path / "a.json", terms, alone=alone))
    assert told.spans == {"E": (2e3, 3e3), "eta / E": (3e-3, 5e-3)}
    assert told.passed_over == ("stiffening",)
