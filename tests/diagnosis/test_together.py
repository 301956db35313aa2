"""Two laws planted: fitted beside one another they come out as planted, where each alone makes up for the other."""

import numpy as np
import pytest
from planted import GRID, recording

from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis.clip import clip_of
from surgisim.diagnosis.diagnose import Refit, prepare_case
from surgisim.diagnosis.errors import rms
from surgisim.diagnosis.evidence import Finding
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.laws import law_of, respond
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.together import together

WEIGHT, AXIS, TURN = np.array([6.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), 0.25


@pytest.fixture(scope="module")
def case():
    planted = {
        "gravity": {"x": 6.0, "y": 0.0, "z": 0.0, "onset": -1.0},
        "fibre": {"k1": 4e3, "k2": 0.5, "yaw": 0.0, "pitch": np.pi / 2},
    }
    clip = clip_of(recording(values=planted), share=GRID)
    return prepare_case(clip, Diagnosing(grid=GRID, nulls=8), Memo(None, ""), lambda *_: None)


def found(case, h: Hypothesis, amplitude: np.ndarray) -> Refit:
    response = respond(case.clip, case.base, law_of(h, amplitude, case.clip), case.memo) - case.base.simulated
    finding = Finding(h, 50.0, amplitude, 0.1 * np.abs(amplitude), 100.0, np.zeros(1), 0, 1e-4)
    return Refit(finding, amplitude, response, 100.0, 50.0)


def test_laws_that_are_fitted_together_do_not_make_up_for_each_other(case):
    off = np.array([np.sin(TURN), np.cos(TURN), 0.0])
    weight = found(case, Hypothesis("gravity", np.eye(3), 0, None, 0.0), 0.6 * WEIGHT)
    strand = found(
        case, Hypothesis("fibre", np.eye(1), 1, None, None, None, {"k2": 0.5, "axis": off}), np.array([1.5e3])
    )
    said = []
    apart = together(case, [weight, strand], said.append, free=False)
    both = together(case, [weight, strand], said.append, free=True)
    assert rms(case, both.moved)[0] < rms(case, apart.moved)[0]
    assert both.refits[0].amplitude == pytest.approx(WEIGHT, abs=1.5)
    assert abs(both.refits[1].finding.hypothesis.about["axis"] @ AXIS) > np.cos(0.5 * TURN)
    assert len(both.refits[0].draws) == len(both.refits[1].draws) > 0
    assert any("gravity and fibre" in text for text in said)
