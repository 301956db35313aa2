"""Frames held out confirm a right prediction, refute a wrong one, and cannot show one that does nothing there."""

import numpy as np
import pytest
from planted import NOISE

from surgisim.diagnosis.metric import metric
from surgisim.diagnosis.noise import Noise, whitener
from surgisim.diagnosis.prospect import Prospect

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


def test_a_right_prediction_is_confirmed(world):
    held_out, effect, _ = world
    gain = held_out.gain(np.zeros_like(effect), effect)
    assert gain.confirmed
    assert not gain.refuted
    assert gain.low < gain.value < gain.high
    # Of a right prediction the gain is normal, of twice the root of what is expected.
    assert gain.value == pytest.approx(gain.expected, abs=6 * np.sqrt(gain.expected))


def test_a_wrong_one_is_refuted(world):
    held_out, effect, _ = world
    gain = held_out.gain(effect, effect[::-1])
    assert gain.refuted
    assert not gain.confirmed


def test_one_that_does_nothing_there_is_not_visible(world):
    held_out, effect, _ = world
    early = effect.copy()
    early[:, UNTIL:] = 0.0
    early[:, :UNTIL] -= early[:, :UNTIL].mean(1, keepdims=True)
    gain = held_out.gain(np.zeros_like(effect), 0.02 * early)
    assert not any((gain.visible, gain.confirmed, gain.refuted))


def test_a_drift_that_goes_on_costs_no_prediction_anything(world):
    held_out, effect, drift = world
    ahead, along = held_out.misfit(held_out.moved - effect), held_out.misfit(held_out.moved - effect - drift)
    assert ahead.sum() - along.sum() == pytest.approx(0.0, abs=4.0)
    assert ahead.sum() / (3 * held_out.whiten_all.mask[:, UNTIL:].sum()) == pytest.approx(1.0, abs=0.15)
