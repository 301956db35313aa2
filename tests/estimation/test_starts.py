"""A ring-down read at another pace is that of tissue with another modulus, so one tells of all."""

from types import SimpleNamespace

import numpy as np
import pytest

from surgisim.estimation import rounds
from surgisim.estimation.search import search
from surgisim.estimation.starts import WITHIN, Freed, _of_each_valley, at_pace, choose_starts, freed
from surgisim.mpm.simulator import Breakdown
from surgisim.verification import clip_length


def swung(modulus: float, time: np.ndarray) -> np.ndarray:
    """A damped swing whose pace goes with the root of its modulus, (T, 1, 1)."""
    t = np.maximum(time, 0.0) * np.sqrt(modulus)
    return (np.exp(-0.3 * t) * np.cos(2 * t))[:, None, None]


@pytest.mark.parametrize("later", [-0.5, 0.0, 0.5])
def test_a_swing_read_faster_or_slower_is_that_of_another_modulus(later):
    free = Freed(let_go=6.5, last=30)
    held = swung(1.0, np.arange(free.since + 1) - free.let_go)
    fine = free.since + np.arange(WITHIN * (free.last - free.since) + 1) / WITHIN
    read = at_pace(held, swung(1.0, fine - free.let_go), free, 0.5, later)
    wanted = swung(0.25, np.arange(31) - free.let_go - later)
    assert read.shape == wanted.shape
    assert abs(read - wanted).max() < 0.02


def test_the_longest_stretch_without_a_grip_is_read():
    active = np.zeros((1, 40), bool)
    active[0, 5:10] = active[0, 13:20] = True
    motion = SimpleNamespace(active=active, late=np.array([0.3]))
    assert freed(motion, 40) == Freed(19.3, 39)
    assert Freed(let_go=0.2, last=5).since == 0
    assert Freed(let_go=-1.0, last=5).since == 0
    assert freed(SimpleNamespace(active=np.ones((1, 8), bool), late=np.zeros(1)), 8) is None


def test_another_pace_keeps_what_a_swing_dies_off_by():
    wanted = search(["corotated", "newtonian"], {}, [])
    x = wanted.paced(wanted.start, 1.0)
    before, after = wanted.values(wanted.start), wanted.values(x)
    assert after["corotated"]["E"] == pytest.approx(before["corotated"]["E"] * np.e)
    assert after["newtonian"]["eta"] == pytest.approx(before["newtonian"]["eta"] * np.sqrt(np.e))
    assert after["corotated"]["nu"] == before["corotated"]["nu"]


def test_the_start_lies_in_the_planted_modulus_own_valley():
    trial, _ = clip_length.trial(2 * clip_length.PERIOD)
    history = []
    x = choose_starts(trial, trial.wanted.start, history, lambda *_: None)[0]
    found = trial.wanted.values(x)
    assert found["corotated"]["E"] == pytest.approx(clip_length.TRUE["corotated"]["E"], rel=0.25)
    assert all(h["round"] == "start" for h in history)


def test_of_every_valley_one_start_comes_before_seconds_of_any():
    wanted = search(["corotated", "newtonian"], {}, [])
    at = [wanted.paced(wanted.start, modulus, damping) for modulus, damping in ((0, 0), (0.1, 0.6), (-2, 0), (-2.1, 1))]
    first, others = _of_each_valley(at, wanted)
    assert [next(k for k, x in enumerate(at) if x is f) for f in first + others] == [0, 2, 1, 3]
    assert len(first) == 2
    assert wanted.log_modulus_ratio(at[0], at[1]) == pytest.approx(0.1)
    assert wanted.log_modulus_ratio(at[2], at[0]) == pytest.approx(2.0)


def ends(costs: dict[float, float | None]):
    """A descent that ends at these costs for starts of these stiffnesses, None where it breaks."""

    def descend(trial, x, ends, settings, rows, say, lead):
        cost = costs[float(x[0])]
        if cost is None:
            raise Breakdown("broken")
        rows.append({"round": 0, "cost": cost})
        return trial, SimpleNamespace(x=x, residual=cost)

    return descend


@pytest.mark.parametrize(("costs", "lowest"), [((9.0, 4.0), 1), ((4.0, 9.0), 0), ((9.0, None), 0), ((None, 9.0), 1)])
def test_the_valley_that_ends_lowest_is_taken_and_the_others_are_told_as_rivals(monkeypatch, costs, lowest):
    monkeypatch.setattr(rounds, "descend", ends(dict(zip((0.0, 1.0), costs, strict=True))))
    monkeypatch.setattr(rounds, "cost_of", lambda r, x, wanted: r)
    history = []
    starts = [np.array([0.0]), np.array([1.0])]
    _, solution = rounds.lowest(SimpleNamespace(wanted=None), starts, [5], None, history, None)
    assert solution.x is starts[lowest]
    assert [h["cost"] for h in history if h["round"] == 0] == [costs[lowest]]
    assert len(history) == sum(c is not None for c in costs)


def test_a_valley_is_given_up_that_falls_behind_after_two_steps():
    lead = [{"round": 0, "iteration": i, "cost": c} for i, c in enumerate((1000.0, 500.0, 300.0, 290.0))]
    row = {"round": 0, "iteration": 2, "cost": 320.0}
    assert not rounds.outrun(row, lead)
    assert rounds.outrun(row | {"cost": 340.0}, lead)
    assert not rounds.outrun({"round": 0, "iteration": 1, "cost": 900.0}, lead), "too early to tell"
    assert rounds.outrun({"round": 0, "iteration": 9, "cost": 330.0}, lead), "against where the other ended"
    assert not rounds.outrun(row | {"round": 1, "cost": 900.0}, lead), "in a round that the other has not come to"


def test_what_a_given_up_descent_came_to_is_told_as_a_rivals(monkeypatch):
    def descend(trial, x, ends, settings, rows, say, lead):
        rows.append({"round": 0, "cost": float(x[0])})
        if lead:
            raise rounds.Outrun
        return trial, SimpleNamespace(x=x, residual=float(x[0]))

    monkeypatch.setattr(rounds, "descend", descend)
    monkeypatch.setattr(rounds, "cost_of", lambda r, x, wanted: r)
    history, starts = [], [np.array([4.0]), np.array([3.0])]
    _, solution = rounds.lowest(SimpleNamespace(wanted=None), starts, [5], None, history, None)
    assert solution.x is starts[0]
    assert history == [{"round": 0, "cost": 4.0}, {"round": "rival", "cost": 3.0}]


def test_where_every_start_breaks_it_is_said(monkeypatch):
    monkeypatch.setattr(rounds, "descend", ends({0.0: None}))
    with pytest.raises(Breakdown):
        rounds.lowest(SimpleNamespace(wanted=None), [np.array([0.0])], [5], None, [], None)
