"""Laws that fitted frames say little of are asked what they foretell."""

from types import SimpleNamespace

import numpy as np
import pytest

from surgisim.diagnosis import diagnose
from surgisim.diagnosis.calibration import CLEAR, SOME

GAINS = {"fibre": 30.0, "damage": 8.0, "tether": 0.5 * SOME}


@pytest.fixture
def heard(monkeypatch):
    """Which laws are run of those that are there beside a first one, `fibre`."""
    monkeypatch.setattr(diagnose, "sharpened", lambda case, law, z: (law.best, 0.0))
    monkeypatch.setattr(diagnose, "of_laws", lambda case, refits, moved: moved)
    monkeypatch.setattr(diagnose, "of_base", lambda case: case.base.simulated)
    monkeypatch.setattr(diagnose, "refit", lambda case, finding, evidence, z, rounds: (finding.gain, rounds))
    laws = {term: SimpleNamespace(best=SimpleNamespace(gain=gain)) for term, gain in GAINS.items()}

    def run(evidence: float, refuted: bool, held_out: bool = True, guessed: bool = False):
        ahead = SimpleNamespace(gain=lambda before, after: SimpleNamespace(refuted=refuted))
        case = SimpleNamespace(
            clip=SimpleNamespace(recording=SimpleNamespace(guessed=guessed)),
            prospect=ahead if held_out else None,
            base=SimpleNamespace(simulated=np.zeros(1)),
            z=None,
            workers=1,
        )
        first = SimpleNamespace(term="fibre", log_evidence=evidence, response=np.ones(1))
        return diagnose.unheard(case, laws, sorted(GAINS), [first], lambda *_: None)

    return run


def test_all_others_that_gain_anything_are_run_once_where_the_best_is_faint_or_refuted(heard):
    assert heard(CLEAR - 1, refuted=False) == [(GAINS["damage"], 1)]
    assert heard(CLEAR + 1, refuted=True) == [(GAINS["damage"], 1)]


def test_none_is_where_the_fitted_frames_are_clear_or_nothing_is_held_out_or_a_body_is_guessed(heard):
    assert heard(CLEAR + 1, refuted=False) == []
    assert heard(CLEAR - 1, refuted=True, held_out=False) == []
    assert heard(CLEAR - 1, refuted=True, guessed=True) == []
