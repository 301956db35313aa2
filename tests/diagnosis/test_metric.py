"""What is left of a residual beside nuisances a hundred thousand times the noise is the noise."""

import numpy as np
import pytest

from surgisim.diagnosis.metric import LARGE, metric, products

N, SMALL, HUGE = 6000, 20, 6


@pytest.fixture(scope="module")
def world():
    rng = np.random.default_rng(11)
    large = 1e5 * (rng.standard_normal((N, 1)) + 1e-3 * rng.standard_normal((N, HUGE))) / np.sqrt(N)
    columns = np.concatenate([0.3 * rng.standard_normal((N, SMALL)), large], 1).astype(np.float32)
    U = columns.astype(float)
    residuals = rng.standard_normal((N, 3)) + U @ rng.standard_normal((SMALL + HUGE, 3))
    return metric(columns), residuals, np.linalg.inv(np.eye(N) + U @ U.T)


def test_products_are_those_of_double_precision(world):
    space, residuals, inverse = world
    assert len(space.large) == HUGE
    assert np.sqrt(np.diag(space.own)[:SMALL]).max() < LARGE
    assert space.gram(residuals, residuals) == pytest.approx(residuals.T @ inverse @ residuals, abs=0.01)
    assert np.diag(space.gram(residuals, residuals)) / N == pytest.approx(1.0, abs=0.1)
    assert space.own == pytest.approx(products(space.columns, space.columns))
    log_det = np.linalg.slogdet(inverse)[1]
    assert space.log_det == pytest.approx(-log_det, rel=1e-6)


def test_nothing_large_is_left_of_a_residual(world):
    space, residuals, inverse = world
    assert space.cleared(residuals) == pytest.approx(inverse @ residuals, abs=1e-4)
    assert space.cleared(residuals[:, 0]) == pytest.approx(inverse @ residuals[:, 0], abs=1e-4)
    assert space.columns.T.astype(float) @ space.cleared(residuals) == pytest.approx(space.likely(residuals), abs=0.1)
