"""What is taken for granted counts as much as it bends the numbers, and a rival as much as it is probable."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from slab import slab
from slab_clip import CAMERA

from surgisim.estimation.gauss_newton import Solution
from surgisim.estimation.lay import Laying, upright
from surgisim.estimation.otherwise import Otherwise, answers, better, rivals, shares
from surgisim.estimation.search import Search, search
from surgisim.estimation.support import open_depth
from surgisim.estimation.trial import Trial

COUNT = 4000
REGION = np.repeat(np.arange(20), COUNT // 20)


@dataclass(frozen=True)
class Linear:
    """A trial whose residuals are straight in its numbers."""

    workers = 2

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


def test_what_was_taken_for_granted_counts_whole():
    trial, solution = fitted()
    noise = np.random.default_rng(1).normal(size=COUNT)
    noise -= trial.slope @ np.linalg.lstsq(trial.slope, noise, rcond=None)[0]
    other = away(trial, 0.3, 0.0, -0.2)
    for off in (other.off, other.off + noise):
        [answer] = answers(solution, [Otherwise("lens", replace(other, off=off))], silent, REGION)
        assert answer.x - solution.x == pytest.approx([0.3, 0.0, -0.2], rel=0.02, abs=1e-3)
        assert shares(solution, trial.wanted, [answer], REGION) == [1.0]


@dataclass(frozen=True)
class Broken(Linear):
    """One that cannot be simulated."""

    def residual(self, x, worker=0, last=None):
        return None


@pytest.mark.parametrize(("bears", "part"), [([-1.0], -1.0), ([-0.5, 0.25], -0.5), ([0.25], 0.25)])
def test_where_a_whole_change_cannot_be_simulated_a_part_counts_as_much(bears, part):
    trial, solution = fitted()
    shift = np.array([0.3, 0.0, -0.2])

    def changed(by):
        there = away(trial, *(by * shift))
        return Otherwise("slope", there if by in bears else Broken(**vars(there)), part=by, changed_by=changed)

    [answer] = answers(solution, [changed(1.0)], silent, REGION)
    [share] = shares(solution, trial.wanted, [answer], REGION)
    off = answer.x - solution.x
    assert answer.one.part == part
    assert share * np.outer(off, off) == pytest.approx(np.outer(shift, shift), rel=0.05, abs=1e-3)


def test_what_no_part_of_can_be_simulated_says_nothing():
    trial, solution = fitted()

    def changed(by):
        return Otherwise("slope", Broken(**vars(trial)), part=by, changed_by=changed)

    [answer] = answers(solution, [changed(1.0)], silent, REGION)
    assert answer.residual is None
    assert np.array_equal(answer.x, solution.x)


def test_a_misfit_says_less_of_rivals_where_regions_pull_the_numbers_apart():
    trial, _ = fitted()
    noise = np.random.default_rng(3).normal(size=COUNT)
    noise -= trial.slope @ np.linalg.lstsq(trial.slope, noise, rcond=None)[0]
    apart = np.repeat(np.random.default_rng(4).normal(size=20), COUNT // 20)[:, None] * trial.slope
    apart = 5 * apart.sum(1) / np.abs(apart.sum(1)).mean()
    apart -= trial.slope @ np.linalg.lstsq(trial.slope, apart, rcond=None)[0]
    share = {}
    for name, off in (("agreeing", noise * np.sqrt(np.mean(apart**2))), ("apart", apart)):
        solution = Solution(trial.wanted.start, off, trial.slope)
        rival = Otherwise("rival", replace(trial, off=1.05 * off), rival=True)
        [share[name]] = shares(solution, trial.wanted, answers(solution, [rival], silent, REGION), REGION)
    assert share["agreeing"] < share["apart"] < 0.5


def test_rivals_share_by_how_well_they_fit():
    trial, solution = fitted()
    worse = np.zeros(COUNT)
    worse[:] = 0.1
    worse -= trial.slope @ np.linalg.lstsq(trial.slope, worse, rcond=None)[0]
    found = answers(
        solution,
        [
            Otherwise("as good", away(trial, 0.3, 0.0, 0.0), rival=True),
            Otherwise("poor", replace(trial, off=trial.off + 20 * worse), rival=True),
        ],
        silent,
        REGION,
    )  # fmt: skip
    as_good, poor = shares(solution, trial.wanted, found, REGION)
    assert as_good == pytest.approx(0.5, abs=0.02)
    assert poor < 1e-6


def test_a_number_that_is_not_fitted_anew_stays():
    trial, solution = fitted()
    begin = trial.wanted.start + np.array([0.5, 0.0, 0.0])
    one = Otherwise("stiffer", trial, rival=True, begin=begin, open=np.array([False, True, True]))
    [answer] = answers(solution, [one], silent, REGION)
    assert (answer.x - solution.x)[0] == pytest.approx(0.5)


@dataclass(frozen=True)
class Counted(Linear):
    """The same, counting how often it is asked."""

    asked: list

    def residual(self, x, worker=0, last=None):
        self.asked.append(x)
        return super().residual(x)


def test_a_rival_that_cannot_come_near_is_left_early():
    trial, _ = fitted()
    noise = np.random.default_rng(5).normal(size=COUNT)
    noise -= trial.slope @ np.linalg.lstsq(trial.slope, noise, rcond=None)[0]
    solution, bent = Solution(trial.wanted.start, noise, trial.slope), replace(trial, off=4 * noise)
    asked = {}
    for rival in (True, False):
        counted = Counted(bent.wanted, 0.5 * bent.slope, bent.off, [])
        begin = trial.wanted.start + np.array([0.8, 0.1, 0.4])
        answers(solution, [Otherwise("other", counted, rival=rival, begin=begin)], silent, REGION)
        asked[rival] = len(counted.asked)
    assert asked[True] < asked[False]


def test_a_fit_gives_way_to_a_far_more_probable_one_only():
    trial, _ = fitted()
    off = np.random.default_rng(2).normal(size=COUNT)
    worse = Solution(trial.wanted.start, 1.5 * off, trial.slope)
    changed = [Otherwise("edge", replace(trial, off=off), rival=True)]
    assert better(worse, trial.wanted, answers(worse, changed, silent, REGION), REGION).one is changed[0]
    same = Solution(trial.wanted.start, off, trial.slope)
    assert better(same, trial.wanted, answers(same, changed, silent, REGION), REGION) is None


def test_no_edge_is_asked_about_twice():
    body = slab()
    laid = upright(body, CAMERA)
    wanted = replace(search(["corotated", "newtonian"], {}, []), depth=open_depth(laid))
    # Tissue of so few cells that two margins are as many of them.
    columns = replace(laid, spacing=wanted.depth.size)
    laying = Laying(columns, columns.spacing, True, None, None)
    trial = Trial([], wanted, None, None, None, 25.0, 2, np.arange(2), laying=laying)
    asked = [one.about for one in rivals(trial, wanted.start)]
    assert len(asked) == len(set(asked))
    assert sum("beyond" in about for about in asked) == 3


def silent(*_):
    pass
