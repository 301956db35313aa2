"""What is said of a measured depth's error: how much it changes where nothing moves, and what lies beside a point."""

import numpy as np
import pulled_sheet
import pytest

from surgisim.artifacts.depth import Depth
from surgisim.perception.tracking import Paths
from surgisim.perception.tracking.lift import FINE, lift

FRAMES, HEIGHT, WIDTH, FAR = 40, 48, 64, 0.06


@pytest.fixture
def still():
    """Points that stand still in the picture, (K, T, 2), away from its border."""
    x, y = np.meshgrid(np.arange(6.0, 58, 4), np.arange(6.0, 42, 4))
    xy = np.repeat(np.stack([x.ravel(), y.ravel()], -1)[:, None], FRAMES, 1).astype(np.float32)
    return Paths(xy, np.ones(xy.shape[:2], bool), np.full(xy.shape[:2], 0.05, np.float32))


def along(paths, z, follows=True):
    """Standard deviations along the view that are said [m], (K, T)."""
    sure = np.ones(z.shape, np.float32)
    depth = Depth(z.astype(np.float32), sure, "known", follows)
    return lift(paths, depth, pulled_sheet.camera(WIDTH, HEIGHT, FRAMES)).sigma_xyz[..., 1]


def test_a_depth_that_changes_where_nothing_moves_is_as_uncertain_as_it_changes(still):
    error = 0.0015 * np.random.default_rng(3).normal(size=(FRAMES, 1, 1)) * np.ones((1, HEIGHT, WIDTH))
    error[0] = 0
    said = along(still, FAR + error)
    assert 0.001 < np.median(said) < 0.002


def test_one_that_stays_is_as_certain_as_it_is_said_to_be(still):
    said = along(still, np.full((FRAMES, HEIGHT, WIDTH), FAR))
    np.testing.assert_allclose(said, FINE * FAR, rtol=1e-5)


def test_beside_an_edge_it_may_be_that_of_the_other_side(still):
    z = np.full((FRAMES, HEIGHT, WIDTH), FAR)
    z[:, :, 32:] = 0.09
    said, x = along(still, z), still.xy[:, 0, 0]
    assert said[abs(x - 31.5) < 2].min() > 0.01
    np.testing.assert_allclose(said[abs(x - 31.5) > 4], FINE * z[:, 20, [0, -1]].max(), rtol=0.6)


def test_a_guess_is_as_uncertain_as_before(still):
    z = np.full((FRAMES, HEIGHT, WIDTH), FAR)
    z[1:, :, 32:] += 0.004
    np.testing.assert_allclose(along(still, z, follows=False)[:, 0], 0.1 * FAR, rtol=1e-5)
