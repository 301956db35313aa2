"""A placebo is what is named but for its active part."""

from dataclasses import replace

import numpy as np
import pytest
from planted import tilted

from surgisim.diagnosis.evidence import Finding, Score
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.joint import Joint
from surgisim.diagnosis.placebo import held, placebo, wrong
from surgisim.diagnosis.refit import Refit
from surgisim.physics.place import Place

MOVED = np.array([0.0, 0.01, 0.3])


@pytest.fixture(scope="module")
def case():
    return tilted()


def finding(term: str, amplitude, *, at=None, evidence=20.0, size=1e-4, **about) -> Finding:
    a = np.atleast_1d(np.array(amplitude, float))
    h = Hypothesis(term, np.eye(len(a)), 1, None if at is None else Place(at, 0.004), 0.0, None, about)
    return Finding(h, evidence, a, 0.1 * np.abs(a), 40.0, np.zeros(1), 0, size)


def score(evidence: float, *findings: Finding) -> Score:
    return Score(evidence, np.zeros(1), list(findings))


def named(case, one: Finding) -> Joint:
    response = np.zeros_like(case.base.simulated)
    return Joint([Refit(one, one.amplitude, response, 40.0, 20.0)], response, 40.0, case.base.x + MOVED)


def test_it_has_the_body_of_what_is_named(case):
    weight = finding("gravity", [8.0, 0.0, 0.0])
    strand = finding("fibre", 4e3, k2=0.5, axis=np.array([0.0, 1.0, 0.0]))
    told = named(case, weight)
    laws = {"gravity": score(50.0, weight), "fibre": score(20.0, strand)}
    given = placebo(case, told, told.refits, laws)
    body = held(case, told.x)
    assert given.refits[0].term == "fibre"
    assert given.x is told.x
    assert given.moved - given.refits[0].response == pytest.approx(body.base.simulated, abs=1e-12)
    # Of the base nothing is open any more, and the residual is that of the base as it is held.
    assert body.space.columns.shape[1] == case.space.columns.shape[1] - len(case.base.slopes)
    until = case.clip.until
    left = case.whiten(case.clip.moved[:, :until] - body.base.simulated[:, :until])
    assert body.z == pytest.approx(left, abs=1e-3)


def test_the_same_law_far_away_goes_before_another_law(case):
    here, near, far = (finding("stiff_inclusion", 0.5, at=(x, 0.0, 0.0)) for x in (0.0, 0.006, 0.02))
    told = named(case, here)
    other = finding("gravity", [1.0, 0.0, 0.0], evidence=99.0)
    laws = {"stiff_inclusion": score(50.0, here, near, far), "gravity": score(20.0, other)}
    assert wrong(told, told.refits, laws) == [far]
    assert wrong(told, told.refits, {**laws, "stiff_inclusion": score(50.0, here, near)}) == [other]


def test_without_a_law_that_acts_there_is_none(case):
    told = named(case, finding("gravity", [8.0, 0.0, 0.0]))
    still = replace(finding("fibre", 0.0, k2=0.5, axis=np.array([0.0, 1.0, 0.0])), size=0.0)
    assert placebo(case, told, told.refits, {"fibre": score(20.0, still)}) is None
