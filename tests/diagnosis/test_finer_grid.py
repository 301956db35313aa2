"""What is shown comes from a finer grid, with the numbers of the search."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from planted import GRID, TILT, case_of, memo_of, recording

from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis import calibration
from surgisim.diagnosis import diagnose as diagnosing
from surgisim.diagnosis.clip import clip_of
from surgisim.diagnosis.diagnose import hazy
from surgisim.diagnosis.evidence import Finding, Score
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.joint import prediction
from surgisim.diagnosis.laws import law_of, respond
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.refit import Refit
from surgisim.diagnosis.replay import replayed

FINE, WEIGHT = 0.18, np.array([8.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def case():
    # One folder for both grids: a run of the one must not pass for a run of the other.
    return case_of(recording(values=TILT), replay=FINE)


@pytest.fixture(scope="module")
def named(case):
    h = Hypothesis("gravity", np.eye(3), 0, None, 0.0)
    moved = respond(case.clip, case.base, law_of(h, WEIGHT, case.clip), case.memo)
    change = moved - case.base.simulated
    finding = Finding(h, 50.0, WEIGHT, 0.1 * np.abs(WEIGHT), 100.0, np.zeros(1), 0, 1e-4)
    return prediction(case, [Refit(finding, WEIGHT, change, 1.0, 1.0)], moved, None)


def test_a_replay_is_the_engines_on_the_finer_grid(case, named):
    shown = replayed(case, named, named)
    fine = replace(clip_of(case.clip.recording, share=FINE), late=case.clip.late)
    law = law_of(named.refits[0].finding.hypothesis, WEIGHT, fine)
    assert shown.clip.body.spacing == fine.body.spacing < case.clip.body.spacing
    assert np.array_equal(shown.clip.rest, case.clip.rest)
    assert shown.after == pytest.approx(respond(fine, case.base, law, Memo(None, "")), abs=1e-7)
    assert shown.placebo == pytest.approx(shown.after)
    assert np.abs(shown.before - case.base.simulated).max() > 1e-5
    # An error of the grid, not of the law: what the law adds is nearly the same.
    added = [after - before for after, before in ((shown.after, shown.before), (named.moved, case.base.simulated))]
    assert np.sum(added[0] * added[1]) > 0.98 * np.sqrt(np.sum(added[0] ** 2) * np.sum(added[1] ** 2))


def test_no_replay_on_a_grid_that_is_not_finer(case, named):
    assert replayed(replace(case, settings=Diagnosing(grid=GRID, replay=GRID)), named, None) is None


@pytest.mark.slow(40)
def test_what_strains_the_nuisances_and_no_law_says_clearly_is_looked_at_on_a_finer_grid(monkeypatch):
    settings = Diagnosing(
        grid=GRID, replay=0.21, nulls=8, experiment=False, free=0, second=False, refine=1, residual=False
    )
    first_look, looked, said, made = diagnosing.first_look, [], [], recording()

    def look(recording, chosen, memo, progress):
        looked.append((chosen.grid, memo.about))
        progress(0.1, 1, "noise")
        progress(0.5, 1, "trying")
        # What a finer grid would show is not looked at here: the coarse one stands for it.
        return first_look(recording, settings, memo_of(made), lambda *_: None)

    monkeypatch.setattr(calibration, "OVERSTRETCHED", 0.0)
    monkeypatch.setattr(diagnosing, "first_look", look)
    monkeypatch.setattr(diagnosing, "unheard", lambda *_: [])
    diagnosing.diagnose(made, settings, lambda share, _, text: said.append((share, text)), memo_of(made))
    (coarse, about), (fine, about_finer) = looked
    assert (coarse, fine) == (GRID, 0.21)
    assert about != about_finer
    shares = [share for share, _ in said]
    assert shares == sorted(shares)
    assert [text for _, text in said[2:4]] == ["noise, on a finer grid", "trying, on a finer grid"]


@pytest.mark.parametrize(
    ("evidence", "strained", "wanted"),
    [(calibration.CLEAR - 1, True, True), (calibration.CLEAR + 1, True, False), (calibration.CLEAR - 1, False, False)],
)
def test_a_law_that_is_clear_needs_no_finer_grid(evidence, strained, wanted):
    laws = {"gravity": evidence, "tether": 3.0}
    assert (
        hazy(SimpleNamespace(overstretched=strained), {term: Score(e, np.zeros(1), []) for term, e in laws.items()})
        == wanted
    )
