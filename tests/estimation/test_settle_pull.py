"""Which edge a body has is told by how well a pull's shape can be fitted with it, not by where that begins."""

from types import SimpleNamespace

import numpy as np
import pytest
from slab import pulled

from surgisim.estimation.observation import PHASES
from surgisim.estimation.rounds import settle_pull
from surgisim.estimation.search import search
from surgisim.mpm.simulator import Breakdown

WANTED = search(["corotated", "newtonian"], {}, [])
NU = WANTED.names.index("corotated.nu")
PHASE = np.full(20, PHASES.index("hold"))


def edge(ratio: float, stays: float) -> SimpleNamespace:
    """A trial that fits best at one Poisson's ratio, and there no better than `stays`."""
    begin = WANTED.start[NU]

    def residual(x, worker=0, last=None):
        return np.concatenate([np.full(3000, 8 * (x[NU] - begin - ratio)), np.full(3000, stays)])

    return SimpleNamespace(
        workers=2,
        wanted=WANTED,
        laying=None,
        motion=pulled(20),
        differences=WANTED.differences,
        fitted=np.arange(1, 20),
        residual=residual,
        together=lambda xs, last: [residual(x) for x in xs],
    )


def test_the_edge_that_fits_best_in_the_end_is_kept():
    near, right = edge(0.0, 0.7), edge(-0.1, 0.3)
    assert np.linalg.norm(near.residual(WANTED.start)) < np.linalg.norm(right.residual(WANTED.start))
    history, told = [], []

    def say(done, of, what):
        told.append(done / of)

    trial, x, _ = settle_pull([near, right], WANTED.start, PHASE, history, say)
    assert trial is right
    assert x[NU] - WANTED.start[NU] == pytest.approx(-0.1, abs=0.02)
    assert np.delete(x, NU) == pytest.approx(np.delete(WANTED.start, NU))
    assert {h["round"] for h in history} == {"pull"}
    assert told == sorted(told)
    assert told[-1] <= 0.12


def test_one_that_cannot_be_simulated_is_left_out():
    right, broken = edge(-0.05, 0.3), edge(0.0, 0.0)

    def breaks(*_, **__):
        raise Breakdown("turned inside out")

    broken.residual = broken.together = breaks
    trial, *_ = settle_pull([broken, right], WANTED.start, PHASE, [], lambda *_: None)
    assert trial is right


def test_a_derivative_is_taken_on_the_first_edge_and_corrected_on_the_others():
    edges, asked = [edge(-0.05, stays) for stays in (0.30, 0.31, 0.32)], [0, 0, 0]

    def counted(k):
        together = edges[k].together

        def count(xs, last):
            asked[k] += len(xs)
            return together(xs, last)

        edges[k].together = count

    for k in range(3):
        counted(k)
    _, x, _ = settle_pull(edges, WANTED.start, PHASE, [], lambda *_: None)
    assert asked[1] < asked[0]
    assert x[NU] - WANTED.start[NU] == pytest.approx(-0.05, abs=0.02)
