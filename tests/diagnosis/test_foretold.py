"""What a prediction's own numbers leave open in frames held out: secants of the base, and a law's strength."""

from types import SimpleNamespace

import numpy as np
import pytest

from surgisim.diagnosis import foretold as made
from surgisim.diagnosis.base import HIGH, Known
from surgisim.diagnosis.calibration import ALIKE_ERRORS, temperature
from surgisim.diagnosis.foretold import FINEST, ByBase
from surgisim.diagnosis.metric import metric
from surgisim.diagnosis.prior import SPREAD, START
from surgisim.mpm.simulator import Breakdown

POINTS, FRAMES, UNTIL = 7, 12, 8
RNG = np.random.default_rng(4)
SLOPES = 1e-4 * RNG.standard_normal((3, POINTS, FRAMES, 3))
"""What the points do by log E, nu and log eta / E [m]."""
ROOT = RNG.standard_normal((3, 3))
NEAR = 0.04 * (ROOT @ ROOT.T) * np.outer(SPREAD, SPREAD)
"""A covariance whose numbers go together."""


def case(near=NEAR, x=START, aside=None):
    """A case whose points move evenly with the base's numbers."""
    known = Known(near, np.zeros((4, 3)) if aside is None else aside)
    clip = SimpleNamespace(until=UNTIL, prior=SimpleNamespace(spread=SPREAD), density=1050.0)
    clip.body = SimpleNamespace(spacing=0.003)
    found = SimpleNamespace(
        clip=clip, base=SimpleNamespace(x=x, simulated=np.tensordot(x, SLOPES, 1), known=known), memo=None, workers=1,
        whiten=lambda field: 1e4 * field.ravel(), space=metric(np.zeros((POINTS * UNTIL * 3, 0), np.float32)),
    )  # fmt: skip
    return found


@pytest.fixture(autouse=True)
def engine(monkeypatch):
    monkeypatch.setattr(made, "tracks_of", lambda clip, x, memo: np.tensordot(x[:3], SLOPES, 1))


def covariance(ways: np.ndarray) -> np.ndarray:
    """Of all coordinates of the frames held out [m^2]."""
    flat = ways[:, :, UNTIL:].reshape(len(ways), -1)
    return flat.T @ flat


def by_slopes(near: np.ndarray) -> np.ndarray:
    late = SLOPES[:, :, UNTIL:].reshape(3, -1)
    return late.T @ near @ late


def test_what_numbers_leave_open_in_frames_held_out_has_their_covariance():
    one = case()
    ways = ByBase(one).ways(one.base.known)
    assert covariance(ways) == pytest.approx(by_slopes(NEAR), rel=1e-6, abs=1e-16)
    assert not ways[:, :, :UNTIL].any()


def test_a_fit_beside_a_law_that_knows_the_numbers_less_leaves_more_open():
    one = case()
    wider = np.diag((0.4 * SPREAD) ** 2)
    assert covariance(ByBase(one).ways(Known(wider, np.zeros((4, 3))))) == pytest.approx(
        by_slopes(wider), rel=1e-6, abs=1e-14
    )


def test_bodies_that_fit_about_as_well_are_part_of_it():
    aside = 0.2 * RNG.standard_normal((50, 3)) * SPREAD
    one = case(aside=aside)
    whole = NEAR + aside.T @ aside / len(aside)
    assert covariance(ByBase(one).ways(one.base.known)) == pytest.approx(by_slopes(whole), rel=1e-6, abs=1e-16)


def test_a_secant_goes_the_other_way_where_no_body_is_tried_or_bears_it(monkeypatch):
    sure = np.diag((0.1 * SPREAD) ** 2)
    expected = by_slopes(sure)
    at_the_end = START.copy()
    at_the_end[1] = HIGH[1] - 1e-4
    one = case(sure, at_the_end)
    assert covariance(ByBase(one).ways(one.base.known)) == pytest.approx(expected, rel=1e-6, abs=1e-16)

    def softer_breaks(clip, x, memo):
        if x[0] < START[0] - 1e-9:
            raise Breakdown("torn apart")
        return np.tensordot(x[:3], SLOPES, 1)

    monkeypatch.setattr(made, "tracks_of", softer_breaks)
    one = case(sure)
    assert covariance(ByBase(one).ways(one.base.known)) == pytest.approx(expected, rel=1e-6, abs=1e-16)

    def breaks(clip, x, memo):
        raise Breakdown("torn apart")

    monkeypatch.setattr(made, "tracks_of", breaks)
    assert not ByBase(case(sure)).fields.any()


def test_numbers_known_to_every_digit_are_still_tried_at_a_step_that_can_be_told(monkeypatch):
    steps = []

    def told(clip, x, memo):
        steps.append(np.linalg.norm((x - START) / SPREAD))
        return np.tensordot(x[:3], SLOPES, 1)

    monkeypatch.setattr(made, "tracks_of", told)
    exact = 1e-18 * np.diag(SPREAD**2)
    ByBase(case(exact))
    assert min(steps) >= 0.999 * FINEST


def test_a_law_s_strength_is_open_by_what_its_chi_square_tells_after_it_is_divided():
    one = case()
    one.by_base = ByBase(one)
    response = 1e-3 * RNG.standard_normal((POINTS, FRAMES, 3))
    law = SimpleNamespace(response=response, gain=50.0, known=None)
    told = made.of_laws(one, [law], one.base.simulated)
    chi = float(((1e4 * response[:, :UNTIL]) ** 2).sum())
    own = told.ways[3]
    assert own[:, UNTIL:] == pytest.approx(
        response[:, UNTIL:] / np.sqrt(1 + chi / temperature(ALIKE_ERRORS, 50.0)), rel=1e-4
    )
    assert not own[:, :UNTIL].any()
    assert len(told.ways) == 4
