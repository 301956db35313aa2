"""A headline is green or red only where its whole interval is."""

import pytest
from report.made_up import invent
from report.test_report import story

from surgisim.report.goals import RIGID, Goal, mark, worst
from surgisim.report.headline import headline
from surgisim.report.parameters import parameters


@pytest.mark.parametrize(
    ("low", "high", "said"), [(1, 2, "good"), (4, 5, "poor"), (2, 4, "few"), (None, None, "few"), (1, 3, "good")]
)
def test_an_interval_that_straddles_the_goal_says_nothing(low, high, said):
    assert mark({"low": low, "high": high}, Goal(3, "lower", "")) == said
    ends = {"low": None if high is None else -high, "high": None if low is None else -low}
    assert mark(ends, Goal(-3, "higher", "")) == said


def test_one_poor_phase_makes_a_poor_headline():
    assert worst(["good", "few", "poor"]) == "poor"
    assert worst(["good", "few"]) == "few"
    assert worst(["good", "good"]) == "good"
    assert worst([]) == "plain"


def test_the_replay_is_held_against_still_and_rigid_phase_by_phase():
    made = invent((40, 48), 32, 0)
    card = {c.title: c for c in headline(story(made))}["Replay's motion"]
    assert [line.phase for line in card.lines] == ["load", "hold", "released"]
    assert card.mark == "good"
    assert all("still" in line.beside and "rigid" in line.beside for line in card.lines)
    told = story(made)
    entry = told.metrics.values["simulation"]["true_held_out_hold_moving_of_rigid"]
    entry |= {"low": RIGID.at - 1, "high": RIGID.at + 1}
    assert {c.title: c.mark for c in headline(told)}["Replay's motion"] == "few"


def test_a_truth_outside_is_red_whether_told_or_not():
    made = invent((40, 48), 12, 0)
    measured = {"corotated.E": {"true": 99999.0, "inside": False}}
    rows = {p.name: p for p in parameters(made["physics"], made["fit"], measured)}
    assert rows["corotated.E"].told == "no"
    assert (rows["corotated.E"].mark, rows["corotated.E"].inside) == ("poor", "outside")
    assert rows["newtonian.eta"].mark == "plain"
