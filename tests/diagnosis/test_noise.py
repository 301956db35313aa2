"""Tracking noise is told from quiet frames, and whitened away."""

import numpy as np
import pytest
from planted import NOISE

from surgisim.diagnosis.metric import metric
from surgisim.diagnosis.noise import Noise, estimate, whitener

FRAMES = 80


@pytest.fixture(scope="module")
def drawn():
    rng = np.random.default_rng(5)
    rest = np.append(rng.uniform(0, 0.04, (50, 2)), np.zeros((50, 1)), 1)
    noise = Noise(level=2e-4 * np.exp(0.2 * rng.standard_normal(50)), **NOISE)
    tracks = noise.draw(rest, FRAMES, rng) + 3e-4 * rng.standard_normal((50, 1, 3))
    seen = rng.random((50, FRAMES)) > 0.02
    return rest, noise, np.where(seen[..., None], tracks, 0.0), seen


def test_the_noise_that_was_drawn_is_found(drawn):
    rest, noise, tracks, seen = drawn
    found = estimate(tracks, seen, rest, np.ones(FRAMES, bool), np.full(50, 2e-4))
    assert found.sigma == pytest.approx(noise.sigma, rel=0.15)
    assert found.shared / (found.shared + found.lasting + found.white) == pytest.approx(0.3 / 0.95, abs=0.12)
    white = whitener(found, rest, seen)(tracks)
    freedom = 3 * (seen.sum() - 50)
    assert (white**2).sum() / freedom == pytest.approx(1.0, abs=0.1)


def test_a_constant_of_a_point_is_no_residual(drawn):
    rest, noise, _, seen = drawn
    whiten = whitener(noise, rest, np.ones_like(seen))
    constant = np.broadcast_to(np.random.default_rng(0).standard_normal((50, 1, 3)), (50, FRAMES, 3))
    assert np.abs(whiten(constant)).max() < 1e-9


def test_back_is_the_transpose(drawn):
    rest, noise, tracks, seen = drawn
    whiten = whitener(noise, rest, seen)
    other = np.random.default_rng(1).standard_normal(whiten(tracks).shape)
    assert whiten(tracks) @ other == pytest.approx((whiten.back(other) * tracks).sum(), rel=1e-9)


def test_the_metric_is_the_inverse_of_the_whole_covariance():
    rng = np.random.default_rng(2)
    U, a = rng.standard_normal((30, 4)), rng.standard_normal((30, 2))
    wanted = a.T @ np.linalg.solve(np.eye(30) + U @ U.T, a)
    assert np.allclose(metric(U).gram(a, a), wanted, rtol=1e-4, atol=1e-4)
