"""Two laws planted: fitted beside one another they come out as planted, where each alone makes up for the other."""

import numpy as np
import pytest
from planted import SLOWLY, TRUE, case_of, recording

from surgisim.diagnosis import calibration, judgement
from surgisim.diagnosis.evidence import Finding
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.joint import Joint, fit_jointly, needed, prediction
from surgisim.diagnosis.laws import joined, law_of, respond
from surgisim.diagnosis.refit import Refit

WEIGHT, AXIS, TURN = np.array([6.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), 0.25


@pytest.fixture(scope="module")
def case():
    planted = {
        "gravity": {"x": 6.0, "y": 0.0, "z": 0.0, "onset": -1.0},
        "fibre": {"k1": 4e3, "k2": 0.5, "yaw": 0.0, "pitch": np.pi / 2},
    }
    # Weight alone moves the whole picture as a camera does, and nothing drifts here.
    return case_of(recording(values=planted, fps=SLOWLY)).drifting(np.full(3, 1e-4))


def found(case, h: Hypothesis, amplitude: np.ndarray) -> Refit:
    response = respond(case.clip, case.base, law_of(h, amplitude, case.clip), case.memo) - case.base.simulated
    finding = Finding(h, 50.0, amplitude, 0.1 * np.abs(amplitude), 100.0, np.zeros(1), 0, 1e-4)
    return Refit(finding, amplitude, response, 100.0, 50.0)


@pytest.mark.slow(90)
def test_laws_that_are_fitted_together_do_not_make_up_for_each_other(case):
    off = np.array([np.sin(TURN), np.cos(TURN), 0.0])
    weight = found(case, Hypothesis("gravity", np.eye(3), 0, None, 0.0), 0.6 * WEIGHT)
    strand = found(
        case, Hypothesis("fibre", np.eye(1), 1, None, None, None, {"k2": 0.5, "axis": off}), np.array([1.5e3])
    )
    said = []
    apart = fit_jointly(case, [weight, strand], said.append, free=False)
    both = fit_jointly(case, [weight, strand], said.append, free=True)
    assert both.gain > apart.gain
    # Of a weight only its share of the stiffness is told, and the recording was made on the search's own grid.
    far = TRUE[0] - case.clip.on_grid(both.x)[0]
    assert both.refits[0].amplitude * np.exp(far) == pytest.approx(WEIGHT, abs=0.8)
    assert abs(far) < both.refits[0].known.spread[0]
    assert abs(both.refits[1].finding.hypothesis.about["axis"] @ AXIS) > np.cos(0.5 * TURN)
    assert len(both.refits[0].draws) == len(both.refits[1].draws) > 0
    assert any("gravity and fibre" in text for text in said)


@pytest.mark.slow(5)
def test_a_law_that_came_out_as_nothing_is_dropped_and_one_that_says_something_is_not(case, monkeypatch):
    weight = found(case, Hypothesis("gravity", np.eye(3), 0, None, 0.0), WEIGHT)
    strand = found(
        case, Hypothesis("fibre", np.eye(1), 1, None, None, None, {"k2": 0.5, "axis": AXIS}), np.array([4e3])
    )
    nothing = found(case, Hypothesis("stiffening", np.eye(1), 1), np.array([1e-6]))

    def fitted(*refits):
        law = joined([law_of(r.finding.hypothesis, r.amplitude, case.clip) for r in refits])
        return prediction(case, list(refits), respond(case.clip, case.base, law, case.memo), None)

    idle = fitted(nothing, weight)
    kept = needed(case, idle)
    assert [r.term for r in kept.refits] == ["gravity"]
    assert kept.gain == pytest.approx(idle.gain, abs=1.0)
    assert case.base.simulated + kept.refits[0].response == pytest.approx(kept.moved)
    both = fitted(strand, weight)
    # So little of the strands shows in a pull that hardly runs along them: they stay or go with what is asked.
    assert 3.0 < 0.5 * (both.gain - fitted(weight).gain) < 25.0
    monkeypatch.setattr(calibration, "ADDS", 3.0)
    assert needed(case, both) is both
    monkeypatch.setattr(calibration, "ADDS", 25.0)
    assert [r.term for r in needed(case, both).refits] == ["gravity"]


@pytest.mark.parametrize(
    ("gain", "left", "said"), [(400.0, 0.1, True), (400.0, 0.3, False), (260.0, 0.1, False), (200.0, 0.4, False)]
)
def test_a_second_law_is_named_for_what_both_explain_together(monkeypatch, gain, left, said):
    one, both = (Joint([], np.array(x), g, np.zeros(3)) for x, g in ((0.4, 200.0), (left, gain)))
    monkeypatch.setattr(judgement, "still", lambda case, moved: float(moved))
    # Half of what is left has to go, and half the gain must exceed 25 + 3 % of 200.
    assert judgement.pays(None, one, both) is said
