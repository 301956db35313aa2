"""One generator left out: nothing is learned of it, and what is learned withholds without naming anew."""

import math

import pytest

from surgisim.problem import Problem
from surgisim.proof.across import FORMAT, PLAIN, across, heated, learn, withheld
from surgisim.proof.board import scoreboard
from surgisim.report.board.across import page
from surgisim.report.made import made

LAWS = ("tether", "fibre")


def case(
    number: int, hidden: str | None, named: str | None, p: float = 0.8, evidence: float = 40.0, family="a"
) -> dict:
    right = named == hidden
    return {
        "recording": f"{family}-{number}", "seed": 1, "case": number, "family": family,
        "kind": "nothing" if hidden is None else "one",
        "concealed": [] if hidden is None else [{"term": hidden, "outside_catalogue": False}],
        "snr": 5.0, "snr_held_out": 2.0, "log_evidence": 0.0 if hidden is None else 60.0, "noise": 1e-4, "phases": [],
        "verdict": "named" if named else "nothing detectable",
        "named": [{"term": named, "probability": p}] if named else [],
        "stated": {named or "tether": p, "fibre" if named != "fibre" else "tether": 1 - p},
        "ranked": [named] if named else [], "wrong_names": [not right] if named else [], "class_holds": None,
        "probability": p if named else None, "probability_of_truth": p if right else 1 - p, "abstained": not named,
        "top1": None if hidden is None else bool(named) and right,
        "top2": None if hidden is None else bool(named), "ranked_first": None if hidden is None else right,
        "both": None, "false_discovery": bool(named) if hidden is None else None, "held_back": None,
        "places": [], "onsets": [], "parameters": [], "held_out": None, "evidence": evidence,
        "detectable_above": None, "missing_phases": [], "words": "",
    }  # fmt: skip


def family(name: str, alarm: float) -> list[dict]:
    """Ten empty ones, one of them an alarm of this log evidence, and ten with a law, two of them named wrongly."""
    empty = [case(k, None, "tether" if k == 0 else None, 0.7, alarm if k == 0 else 3.0, name) for k in range(10)]
    hidden = [
        case(10 + k, LAWS[k % 2], LAWS[(k + (k < 2)) % 2], 0.55 if k < 2 else 0.95, 60.0, name) for k in range(10)
    ]
    return empty + hidden


@pytest.fixture(scope="module")
def boards():
    return {name: scoreboard(family(name, alarm)) for name, alarm in (("a", 20.0), ("b", 25.0), ("c", 8.0))}


def test_the_threshold_is_of_the_other_families_empty_cases(boards):
    found = across(boards)
    assert found["format"] == FORMAT
    rows = {row["family"]: row for row in found["families"]}
    # Of twenty empty ones one may be above it: the second highest of the others decides.
    assert rows["a"]["learned"]["least"] == pytest.approx(8.0, abs=1e-6)
    assert rows["c"]["learned"]["least"] == pytest.approx(20.0, abs=1e-6)
    assert rows["c"]["plain"]["false_discovery"]["hits"] == 1
    assert rows["c"]["kept"]["false_discovery"]["hits"] == 0
    assert rows["b"]["kept"]["alarm"]["hits"] == 1 or rows["b"]["learned"]["sure"] > 0.7


def test_nothing_of_a_family_is_learned_for_itself(boards):
    changed = boards | {"c": scoreboard(family("c", 500.0))}
    assert across(changed)["families"][2]["learned"] == across(boards)["families"][2]["learned"]


def test_names_that_the_others_got_wrong_at_such_a_probability_are_withheld(boards):
    cases = [c for name in ("a", "b") for c in boards[name]["cases"]]
    learned = learn(cases)
    assert learned.sure > 0.55
    doubtful = withheld(case(1, "fibre", "tether", 0.55), learned)
    assert (doubtful["verdict"], doubtful["named"], doubtful["top1"]) == ("unexplained", [], False)
    sure = withheld(case(1, "fibre", "fibre", 0.99), learned)
    assert sure["top1"]
    assert sure["named"][0]["term"] == "fibre"


def test_as_diagnosed_nothing_changes():
    one = case(1, "fibre", "fibre", 0.8)
    same = withheld(one, PLAIN)
    assert {k: same[k] for k in ("verdict", "top1", "wrong_names")} == {
        k: one[k] for k in ("verdict", "top1", "wrong_names")
    }
    assert same["named"][0]["probability"] == pytest.approx(0.8)


def test_heat_is_what_makes_truths_likeliest():
    # Always .95 and right four times in five: too sure by far.
    cases = [case(k, "fibre", "fibre" if k % 5 else "tether", 0.95) for k in range(50)]
    learned = learn(cases)
    assert heated({"fibre": 0.95, "tether": 0.05}, learned.heat)["fibre"] == pytest.approx(0.8, abs=0.02)
    assert heated({"fibre": 0.5, "tether": 0.3}, 1.0) == pytest.approx({"fibre": 0.5, "tether": 0.3})
    assert math.isclose(sum(heated({"a": 0.6, "b": 0.3}, 4.0).values()), 0.9)


def test_one_family_is_refused_and_the_page_stands_alone(boards):
    with pytest.raises(Problem, match="at least two families"):
        across({"a": boards["a"]})
    text = page(across(boards), made()).decode()
    assert "One generator left out" in text
    assert 'src="data:' in text
