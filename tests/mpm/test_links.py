"""Points hang on solid nodes as their stencil hangs on the nodes that follow those."""

import numpy as np
import pytest
from scipy import sparse
from slab import pulled, slab
from test_engine import FPS, SOFT

from surgisim.estimation.trial import at_once
from surgisim.mpm.setup import prepare

BODY = slab(size=(0.036, 0.03, 0.018))


@pytest.fixture(scope="module")
def made():
    return prepare(BODY, tuple(SOFT), density=1050.0, grips=pulled())


def test_weights_and_slopes_are_those_of_the_stencil_through_the_rule(made):
    simulator, size = made.simulator, (60, made.simulator.rule.shape[0])
    # Some lie a cell beyond the body, where nodes follow those inside.
    points = np.random.default_rng(0).uniform(BODY.rest.min(0) - 0.006, BODY.rest.max(0) + 0.004, (60, 3))
    nodes, weight, gradient = simulator.grid.stencil(points)
    index, link = simulator._spline_links(points)
    rows = np.repeat(np.arange(60), 27), np.repeat(np.arange(60), index.shape[1])
    for k, values in enumerate((weight, *np.moveaxis(gradient, -1, 0))):
        through = sparse.csr_matrix((values.ravel(), (rows[0], nodes.ravel())), size) @ simulator.rule
        found = sparse.csr_matrix((link[..., k].ravel(), (rows[1], index.ravel())), through.shape)
        assert abs(found - through).max() < 1e-9 * abs(through).max()


def test_a_body_beside_another_runs_as_it_does(made):
    other = made.simulator.beside()
    drive = made.drive(pulled(), SOFT, fps=FPS, per_frame=made.per_frame(SOFT, FPS))
    here, there = at_once(lambda one, _: one.run(made.theta(SOFT), drive).u, [made.simulator, other])
    assert np.array_equal(here, there)
    assert other.mass is not made.simulator.mass
