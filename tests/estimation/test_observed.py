"""What a film shows of a simulation, and a body laid anew, checked against differences and by counting."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from slab import slab
from slab_clip import CAMERA

from surgisim.estimation.lay import beyond, finer, upright
from surgisim.estimation.observation import Filmed


def filmed(depth_measured: bool) -> tuple[Filmed, np.ndarray]:
    rng = np.random.default_rng(1)
    rest = rng.uniform([-0.02, -0.015, 0.058], [0.02, 0.015, 0.062], (7, 3))
    carry = sparse.csr_matrix(rng.dirichlet(np.ones(5), 7))
    u = rng.normal(0, 2e-3, (4, 5, 3))
    weight = np.full((7, 4, 3), 1 / 3e-4)
    weight[..., 2] *= depth_measured
    seen = rest[:, None] + rng.normal(0, 1e-3, (7, 4, 3))
    return Filmed(rest, seen - rest[:, None], weight, carry, CAMERA, CAMERA.project(seen)), u


@pytest.mark.parametrize("measured", [True, False])
def test_the_derivative_of_what_a_film_shows_agrees_with_differences(measured):
    film, u = filmed(measured)
    frames, step = np.array([1, 3]), 1e-7
    bar = np.random.default_rng(2).normal(size=(7, 2, 3))
    slope = film.pulled_back(bar, u, frames)
    for place in [(1, 0, 0), (1, 3, 2), (3, 4, 1), (3, 2, 2), (2, 1, 1)]:
        up, down = u.copy(), u.copy()
        up[place] += step
        down[place] -= step
        change = (film.residual(up, frames) - film.residual(down, frames)) / (2 * step)
        assert slope[place] == pytest.approx((bar * change).sum(), rel=1e-5, abs=1e-9)


def test_where_depth_is_a_guess_only_the_picture_counts():
    film, _ = filmed(False)
    frames = np.array([1])
    nearer = film.rest / film.rest[:, 2:] * -1e-3
    still = Filmed(film.rest, film.displacement, film.weight, sparse.identity(7).tocsr(), CAMERA, film.pixels)
    along = np.zeros((4, 7, 3))
    along[1] = nearer
    # Along its own ray a point may go anywhere unseen.
    assert still.residual(along, frames) == pytest.approx(still.residual(np.zeros((4, 7, 3)), frames), abs=1e-9)


def test_a_body_is_laid_to_its_depth_whatever_the_layers():
    columns = upright(slab(), CAMERA)
    assert columns.thickness == pytest.approx(0.018)
    for depth in (0.0100, 0.0107, 0.0131):
        laid = columns.laid(depth, rim=False)
        free = ~laid.held
        assert laid.volume[free].sum() == pytest.approx(0.048 * 0.036 * depth, rel=1e-5)
        assert laid.rest[laid.held, 2].min() > 0.06 + depth > laid.rest[free, 2].max()


def test_tissue_beyond_the_picture_lies_on_the_plane_of_its_edge():
    body = slab()
    tilted = body.rest.copy()
    tilted[:, 2] += 0.2 * tilted[:, 0]
    columns = upright(replace(body, rest=tilted), CAMERA)
    wider = beyond(columns, 0.009)
    new = slice(len(columns.xy), None)
    assert np.allclose(wider.above[new], 0.06 + 0.2 * wider.xy[new, 0], atol=2e-4)
    assert wider.area.sum() == pytest.approx((0.048 + 0.018) * (0.036 + 0.018), rel=0.1)
    assert not wider.seen[new].any()
    assert not wider.rim.any()
    held = beyond(columns, 0.009, 0.006)
    away = np.linalg.norm(np.maximum(abs(held.xy) - abs(columns.xy).max(0), 0), axis=1)
    assert np.array_equal(held.rim, away > 0.0092)
    assert held.xy[held.rim].max(0) == pytest.approx(columns.xy.max(0) + 0.015, abs=1e-4)


def test_columns_that_stand_closer_one_way_than_the_other_are_made_finer_without_gaps():
    body = slab()
    squeezed = body.rest * np.array([1.03, 0.98, 1.0], np.float32)
    columns = upright(replace(body, rest=squeezed), CAMERA)
    fine = finer(columns, 1.5)
    nx, ny = np.rint(1.5 * (np.ptp(columns.xy, 0) / columns.pitch + 1))
    assert len(fine.xy) == nx * ny
    assert fine.area.sum() == pytest.approx(columns.area.sum())
    # What is laid around it lies around it.
    wider = beyond(fine, columns.spacing, fine.spacing)
    new = wider.xy[len(fine.xy) :]
    assert (abs(new) > abs(fine.xy).max(0)).any(1).all()
