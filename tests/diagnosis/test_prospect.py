"""Frames held out confirm a right prediction, refute a wrong one, and cannot show one that does nothing there."""

import numpy as np
import pytest
from planted import NOISE

from surgisim.diagnosis.metric import metric
from surgisim.diagnosis.noise import Noise, whitener
from surgisim.diagnosis.prospect import Foretold, Prospect

POINTS, FRAMES, UNTIL = 30, 40, 28


@pytest.fixture(scope="module")
def world():
    """A recording that moves by `effect` in all frames, and drifts as its nuisance may."""
    rng = np.random.default_rng(7)
    rest = np.append(rng.uniform(0, 0.04, (POINTS, 2)), np.zeros((POINTS, 1)), 1)
    noise = Noise(level=np.full(POINTS, 1.5e-4), **NOISE)
    course = np.linspace(0, 1, FRAMES)[:, None]
    drift = np.broadcast_to(1e-3 * course * [1.0, 0.0, 0.0], (POINTS, FRAMES, 3))
    shape = np.exp(-(((rest - rest[0]) / 0.012) ** 2).sum(1))
    pulses = np.sin(np.arange(FRAMES) / 3) ** 2
    effect = 6e-4 * shape[:, None, None] * pulses[None, :, None] * [0.0, 0.0, 1.0]
    seen = rng.random((POINTS, FRAMES)) > 0.1
    moved = np.where(seen[..., None], effect + 1.5 * drift + noise.draw(rest, FRAMES, rng), 0.0)
    parts = []
    for span in (slice(0, UNTIL), slice(0, FRAMES)):
        whiten = whitener(noise, rest, seen[:, span])
        parts += [whiten, metric(whiten(drift[None, :, span]).T)]
    return Prospect(moved, UNTIL, *parts, 0), effect, drift


def sure(moved):
    """A prediction whose numbers are known."""
    return Foretold(moved, np.zeros((0, *moved.shape)))


def test_a_right_prediction_is_confirmed(world):
    held_out, effect, _ = world
    gain = held_out.gain(sure(np.zeros_like(effect)), sure(effect))
    assert gain.confirmed
    assert not gain.refuted
    assert gain.low < gain.value < gain.high
    # Of a right prediction the gain is normal, of twice the root of what is expected.
    assert gain.value == pytest.approx(gain.expected, abs=6 * np.sqrt(gain.expected))


def test_a_wrong_one_is_refuted(world):
    held_out, effect, _ = world
    gain = held_out.gain(sure(effect), sure(effect[::-1]))
    assert gain.refuted
    assert not gain.confirmed


def test_one_that_does_nothing_there_is_not_visible(world):
    held_out, effect, _ = world
    early = effect.copy()
    early[:, UNTIL:] = 0.0
    early[:, :UNTIL] -= early[:, :UNTIL].mean(1, keepdims=True)
    gain = held_out.gain(sure(np.zeros_like(effect)), sure(0.02 * early))
    assert not any((gain.visible, gain.confirmed, gain.refuted))


def test_a_drift_that_goes_on_costs_no_prediction_anything(world):
    held_out, effect, drift = world
    ahead, along = held_out.misfit(held_out.moved - effect), held_out.misfit(held_out.moved - effect - drift)
    assert ahead.sum() - along.sum() == pytest.approx(0.0, abs=4.0)
    assert ahead.sum() / (3 * held_out.whiten_all.mask[:, UNTIL:].sum()) == pytest.approx(1.0, abs=0.15)


def test_what_a_prediction_may_be_off_by_is_weighed_as_a_normal_number_is(world):
    """The twin: all frames' covariance written out, with and without the ways, given the fitted ones."""
    held_out, effect, _ = world
    field = held_out.moved - 0.4 * effect
    way = 0.5 * effect
    way[:, :UNTIL] = 0.0
    ways = np.stack([way, way[::-1]])

    def surprise(metric, white):
        U = metric.columns.astype(float)
        open_to = held_out.whiten_all(ways).T if metric is held_out.space_all else np.zeros((len(white), 0))
        C = np.eye(len(white)) + U @ U.T + open_to @ open_to.T
        return white @ np.linalg.solve(C, white) + np.linalg.slogdet(C)[1]

    ahead, before = (m.columns.astype(float) for m in (held_out.space_all, held_out.space))
    twin = surprise(held_out.space_all, held_out.whiten_all(field))
    twin -= surprise(held_out.space, held_out.whiten(field[:, :UNTIL]))
    # What the metric's own determinants cost is alike for every prediction, and left out.
    twin -= np.linalg.slogdet(np.eye(ahead.shape[1]) + ahead.T @ ahead)[1]
    twin += np.linalg.slogdet(np.eye(before.shape[1]) + before.T @ before)[1]
    assert held_out.misfit(field, ways).sum() == pytest.approx(twin, rel=1e-4)
    assert held_out.misfit(field, ways).sum() < held_out.misfit(field).sum()


def test_a_law_that_is_thrice_too_strong_later_is_not_refuted_where_its_strength_is_open(world):
    held_out, effect, _ = world
    way = 3 * effect
    way[:, :UNTIL] = 0.0
    later, nothing = effect + 2 / 3 * way, sure(np.zeros_like(effect))
    assert held_out.gain(nothing, sure(later)).refuted
    assert held_out.gain(nothing, Foretold(later, 0.7 * way[None])).confirmed
