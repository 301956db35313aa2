"""Where what is held is laid anew, and where a law's misfit would only be taken for a plane's."""

from types import SimpleNamespace

import numpy as np
import pytest
from planted import plain

from surgisim.diagnosis import diagnose, nuisance
from surgisim.diagnosis.evidence import Finding, Score
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.refit import Refit

GAIN = 300.0
"""Chi square that the best law takes away, as the engine runs it."""


def laid(monkeypatch, evidence: float, alone: float, beside: float, better: float) -> float | None:
    """How far up what is held is laid [mm], 0 where it stays near its box; None where it seems to end there.

    alone, beside: where what is held seems to end without the best law and beside it [mm]; better: chi square that
    laying it anew takes away.
    """
    case = plain()
    finding = Finding(Hypothesis("stiffening", np.eye(1)), evidence, np.ones(1), np.ones(1), GAIN, np.zeros(1), 0, 1e-4)
    law = Refit(finding, np.ones(1), 1e-5 * case.base.simulated, GAIN, evidence)

    def told(groups, likely: np.ndarray) -> float:
        # Beside a law its signature is one more column.
        return 1e-3 * (beside if len(likely) > case.space.columns.shape[1] else alone)

    def again(clip, *_):
        moved = SimpleNamespace(clip=clip, misfit=case.misfit - better)
        moved.drifting = lambda size: moved
        return moved

    monkeypatch.setattr(diagnose, "refit", lambda *_: law)
    monkeypatch.setattr(nuisance, "likely_held", told)
    monkeypatch.setattr(diagnose, "prepare_case", again)
    moved = diagnose.laid_anew(case, {"stiffening": Score(evidence, np.zeros(1), [finding])}, lambda *_: None)
    return None if moved is None else 1e3 * moved.clip.raised


@pytest.mark.parametrize(
    ("evidence", "alone", "beside", "better", "raised"),
    [
        (5.0, 2.0, 9.9, 50.0, 2.0),  # nothing is hidden: where it seems to end
        (5.0, 0.5, 9.9, 50.0, None),  # near its box
        (5.0, 2.0, 9.9, 3.0, 0.0),  # worth less than what so far a plane costs beforehand
        (5.0, -9.0, 0.0, 900.0, -4.0),  # never farther than MOST_HELD
        (150.0, 2.0, 0.3, GAIN - 1, 0.0),  # a law makes up for it
        (150.0, 2.0, 0.3, GAIN + 50, 2.0),  # it makes up for a law
        (150.0, 0.3, -1.5, 50.0, -1.5),  # a law hides it
        (150.0, 0.3, 0.3, 900.0, None),
    ],
)
def test_what_is_held_is_laid_anew_where_no_law_says_more(monkeypatch, evidence, alone, beside, better, raised):
    found = laid(monkeypatch, evidence, alone, beside, better)
    assert found == (None if raised is None else pytest.approx(raised))


def test_what_is_held_near_its_box_ends_there_more_surely_and_nulls_know():
    case = plain()
    near = case.open_by("held", 0.4)
    mine = nuisance.span(case.groups, "held")
    assert mine.stop - mine.start == 1
    assert near.space.columns[:, mine] == pytest.approx(0.4 * case.space.columns[:, mine])
    assert near.misfit > case.misfit
    off = nuisance.likely_held(near.groups, near.space.likely(near.z))
    assert abs(off) < abs(nuisance.likely_held(case.groups, case.space.likely(case.z)))
    assert (near.nulls != case.nulls).any()
