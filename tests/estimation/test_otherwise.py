"""What is taken for granted counts as much as it bends the numbers, and as little as the clip lets it."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from surgisim.estimation.gauss_newton import Solution
from surgisim.estimation.otherwise import Otherwise, answers, better, shares
from surgisim.estimation.rounds import INDEPENDENT
from surgisim.estimation.search import Search, search

COUNT = 4000


@dataclass(frozen=True)
class Linear:
    """A trial whose residuals are straight in its numbers."""

    wanted: Search
    slope: np.ndarray
    off: np.ndarray

    def residual(self, x, worker=0, last=None):
        return self.slope @ (x - self.wanted.start) + self.off


def fitted(strength=2.0, seed=0):
    """A trial, and where it fits best: at its start."""
    wanted = search(["corotated", "newtonian"], {}, [])
    slope = strength * np.linalg.qr(np.random.default_rng(seed).normal(size=(COUNT, 3)))[0] * np.sqrt(COUNT)
    trial = Linear(wanted, slope, np.zeros(COUNT))
    return trial, Solution(wanted.start, trial.off, slope)


def away(trial, *shift):
    """The same trial, best fitted at another place, and what it bends there."""
    return replace(trial, off=-trial.slope @ np.array(shift))


def test_what_bends_numbers_and_leaves_no_misfit_counts_whole():
    trial, solution = fitted()
    [answer] = answers(solution, trial.wanted, [Otherwise("lens", away(trial, 0.3, 0.0, -0.2), told=True)], silent)
    assert answer.x - solution.x == pytest.approx([0.3, 0.0, -0.2], rel=0.02, abs=1e-3)
    assert shares(solution, trial.wanted, [answer]) == pytest.approx([1.0], rel=0.02)


def test_what_the_clip_speaks_against_counts_less():
    trial, solution = fitted()
    other = away(trial, 0.3, 0.0, -0.2)
    noise = np.random.default_rng(1).normal(size=COUNT)
    noise -= trial.slope @ np.linalg.lstsq(trial.slope, noise, rcond=None)[0]
    [answer] = answers(
        solution, trial.wanted, [Otherwise("lens", replace(other, off=other.off + noise), told=True)], silent
    )
    assert shares(solution, trial.wanted, [answer]) == pytest.approx([1 / (1 + INDEPENDENT * COUNT)], rel=0.1)


def test_rivals_share_by_how_well_they_fit():
    trial, solution = fitted()
    worse = np.zeros(COUNT)
    worse[:] = 0.1
    worse -= trial.slope @ np.linalg.lstsq(trial.slope, worse, rcond=None)[0]
    found = answers(
        solution, trial.wanted,
        [
            Otherwise("as good", away(trial, 0.3, 0.0, 0.0), rival=True),
            Otherwise("poor", replace(trial, off=trial.off + 20 * worse), rival=True),
        ],
        silent,
    )  # fmt: skip
    as_good, poor = shares(solution, trial.wanted, found)
    assert as_good == pytest.approx(0.5, abs=0.02)
    assert poor < 1e-6


def test_a_number_that_is_not_fitted_anew_stays():
    trial, solution = fitted()
    begin = trial.wanted.start + np.array([0.5, 0.0, 0.0])
    one = Otherwise("stiffer", trial, rival=True, begin=begin, open=np.array([False, True, True]))
    [answer] = answers(solution, trial.wanted, [one], silent)
    assert (answer.x - solution.x)[0] == pytest.approx(0.5)


def test_a_fit_gives_way_to_a_far_more_probable_one_only():
    trial, _ = fitted()
    off = np.random.default_rng(2).normal(size=COUNT)
    worse = Solution(trial.wanted.start, 1.5 * off, trial.slope)
    changed = [Otherwise("edge", replace(trial, off=off), rival=True)]
    assert better(worse, trial.wanted, answers(worse, trial.wanted, changed, silent)).one is changed[0]
    same = Solution(trial.wanted.start, off, trial.slope)
    assert better(same, trial.wanted, answers(same, trial.wanted, changed, silent)) is None


def silent(*_):
    pass
