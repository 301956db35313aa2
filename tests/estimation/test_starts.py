"""A ring-down read at another pace is that of tissue with another modulus, so one tells of all."""

from types import SimpleNamespace

import numpy as np
import pytest

from surgisim.config.estimation import Estimation
from surgisim.estimation import rounds
from surgisim.estimation.search import search
from surgisim.estimation.starts import (
    DAMPING,
    READ,
    SOFTER,
    WITHIN,
    Freed,
    _likely,
    _of_each_valley,
    at_pace,
    choose_starts,
    freed,
    valleys,
)
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


def test_what_reads_far_worse_than_the_best_is_not_simulated():
    costs = [2.0, 1.0, READ, 1.01 * READ, np.inf]
    assert [c for c, _ in _likely((c, np.zeros(1)) for c in costs)] == [1.0, READ]
    assert _likely([]) == []


def test_a_damping_between_those_that_were_read_is_found():
    wanted = search(["corotated", "newtonian"], {}, [])
    modulus, damping = -1.0, 0.4
    read = [(np.abs(SOFTER - modulus) + (d - damping) ** 2, np.zeros(len(SOFTER))) for d in DAMPING]
    _, x = min(valleys(wanted, wanted.start, read), key=lambda start: start[0])
    there, start = wanted.values(x), wanted.values(wanted.start)
    assert there["corotated"]["E"] == pytest.approx(start["corotated"]["E"] * np.exp(0.8 + modulus))
    paced = np.exp(0.5 * (0.8 + modulus) + damping)
    assert there["newtonian"]["eta"] == pytest.approx(start["newtonian"]["eta"] * paced)
    # Where a ring-down cannot be simulated, its neighbours stay where they were read.
    read[1] = np.full(len(SOFTER), np.inf), read[1][1]
    _, x = min(valleys(wanted, wanted.start, read), key=lambda start: start[0])
    damped = np.log(wanted.values(x)["newtonian"]["eta"] / start["newtonian"]["eta"]) - 0.5 * (0.8 + modulus)
    assert min(abs(damped - np.array(DAMPING))) < 1e-6


Costs = dict[float, tuple[float, float]]


def stepping(costs: Costs):
    """Steps in valleys that cost so much after it, for starts of these stiffnesses."""

    def some(trial, x, free, last, iterations):
        if not np.isfinite(costs[float(x[0])][0]):
            raise Breakdown("broken")
        return SimpleNamespace(x=x, residual=costs[float(x[0])][0])

    return some


def descending(costs: Costs):
    """Descents that end at such a cost, for starts of these stiffnesses."""

    def descend(trial, x, ends, settings, rows, say):
        cost = costs[float(x[0])][1]
        if not np.isfinite(cost):
            raise Breakdown("broken")
        rows.append({"round": 0, "cost": cost})
        return trial, SimpleNamespace(x=x, residual=cost)

    return descend


def followed(monkeypatch, *costs: tuple[float, float]):
    """Which of the starts is taken, of those that cost so much after a step and at their ends, and what is told of the
    one that is taken and of its rivals."""
    monkeypatch.setattr(rounds, "_some", stepping(dict(enumerate(costs))))
    monkeypatch.setattr(rounds, "descend", descending(dict(enumerate(costs))))
    monkeypatch.setattr(rounds, "cost_of", lambda r, x, wanted: r)
    history: list = []
    starts = [np.array([float(k)]) for k in range(len(costs))]
    trial = SimpleNamespace(wanted=search(["corotated"], {}, ["corotated.nu"]))
    _, solution = rounds.lowest(trial, starts, [5], Estimation(), history, lambda *_: None)
    told = [[h["cost"] for h in history if (h["round"] == "rival") == rival] for rival in (False, True)]
    return int(solution.x[0]), *told


@pytest.mark.parametrize(("costs", "lowest"), [(((9.0, 8.0), (9.5, 4.0)), 1), (((9.0, 4.0), (9.5, 8.0)), 0)])
def test_of_valleys_that_are_as_good_after_a_step_the_one_that_ends_lowest_is_taken(monkeypatch, costs, lowest):
    assert followed(monkeypatch, *costs) == (lowest, [costs[lowest][1]], [costs[1 - lowest][1]])


def test_a_valley_that_a_step_shows_to_be_worse_is_followed_no_farther(monkeypatch):
    assert followed(monkeypatch, (12.0, 1.0), (9.0, 4.0)) == (1, [4.0], [12.0])


def test_a_start_that_breaks_leaves_the_others(monkeypatch):
    assert followed(monkeypatch, (np.inf, 1.0), (9.0, 4.0)) == (1, [4.0], [None])
    assert followed(monkeypatch, (9.2, np.inf), (9.0, 4.0)) == (1, [4.0], [])


def test_a_single_start_is_followed_at_once(monkeypatch):
    assert followed(monkeypatch, (np.inf, 4.0)) == (0, [4.0], [])


def test_where_every_start_breaks_it_is_said(monkeypatch):
    with pytest.raises(Breakdown):
        followed(monkeypatch, (np.inf, np.inf), (np.inf, np.inf))


def test_a_step_by_some_numbers_leaves_the_others():
    trial, _ = clip_length.trial(2 * clip_length.PERIOD)
    x, wanted = trial.wanted.start, trial.wanted
    last = int(trial.fitted[-1])
    found = rounds._some(trial, x, wanted.paces, last, 1)
    assert (found.x != x).tolist() == wanted.paces.tolist()
    assert found.jacobian.shape == (len(found.residual), wanted.paces.sum())
    before = rounds.cost_of(trial.residual(x, 0, last), x, wanted)
    assert rounds.cost_of(found.residual, found.x, wanted) < before
