"""Laws that act in one place are tried where the best of them acts."""

from types import SimpleNamespace

import numpy as np
import pytest

from surgisim.diagnosis import diagnose
from surgisim.diagnosis.diagnose import gathered
from surgisim.diagnosis.evidence import Finding, Score
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.refit import Refit
from surgisim.physics.place import Place

HERE, BESIDE, FAR = (0.001, 0.0, 0.0), (0.002, 0.0, 0.0), (0.02, 0.0, 0.0)
CASE = SimpleNamespace(z=None, workers=1)


def finding(term: str, center=None, gain: float = 10.0) -> Finding:
    place, scope = (None, "everywhere") if center is None else (Place(center, 0.004), "blob")
    h = Hypothesis(term, np.eye(1), 0, place, scope=scope)
    return Finding(h, gain / 2, np.ones(1), np.ones(1), gain, np.zeros(1), 0, 1e-4)


def fitted(found: Finding, gain: float) -> Refit:
    return Refit(found, np.ones(1), np.zeros((1, 1, 3)), gain, gain / 2)


@pytest.fixture
def engine(monkeypatch):
    """One that says that a lump is HERE, whatever the search made of it."""
    worth = {("stiff_inclusion", BESIDE): 300.0}

    def refit(case, found, evidence, z):
        h = found.hypothesis
        return fitted(found, worth.get((h.term, h.place and h.place.center), 1.0))

    monkeypatch.setattr(diagnose, "refit", refit)
    monkeypatch.setattr(diagnose, "sharpened", lambda case, law, z, start: (start, 0.0))


def scores(*findings: Finding) -> dict[str, Score]:
    terms = {f.hypothesis.term for f in findings}
    return {t: Score(1.0, np.zeros(1), [f for f in findings if f.hypothesis.term == t]) for t in terms}


def test_a_lump_that_the_search_put_elsewhere_is_tried_where_another_law_says_most(engine):
    creep, far, beside = (
        finding("relaxation", HERE),
        finding("stiff_inclusion", FAR),
        finding("stiff_inclusion", BESIDE),
    )
    refits = gathered(CASE, scores(creep, far, beside), [fitted(creep, 200.0), fitted(far, 50.0)])
    assert [(r.term, r.gain) for r in refits] == [("stiff_inclusion", 300.0), ("relaxation", 200.0)]
    assert refits[0].finding is beside


def test_what_says_less_there_stays_where_it_was(engine):
    creep, far, near = finding("relaxation", HERE), finding("damage", FAR), finding("damage", BESIDE)
    whole = finding("gravity")
    tried = [fitted(creep, 200.0), fitted(far, 50.0), fitted(whole, 20.0)]
    assert gathered(CASE, scores(creep, far, near, whole), tried) == tried


def test_a_law_that_acts_everywhere_gathers_nobody(engine):
    whole, far, beside = finding("gravity"), finding("stiff_inclusion", FAR), finding("stiff_inclusion", BESIDE)
    tried = [fitted(whole, 200.0), fitted(far, 50.0)]
    assert gathered(CASE, scores(whole, far, beside), tried) is tried
