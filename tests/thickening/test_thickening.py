import numpy as np
import pytest

from surgisim.config.thickening import Thickening
from surgisim.problem import Problem
from surgisim.thickening import bounding_box, largest_piece, thicken


def test_a_tilted_slab_has_the_volume_its_rays_sweep_inside_the_box(slab, camera):
    surface = slab()
    low, high = bounding_box(surface, camera)
    body = thicken(surface, camera, Thickening(thickness=0.008, cells=30, most_particles=100000))
    rows, columns = np.mgrid[0:48, 0:64].reshape(2, -1)
    above = surface.z[rows, columns][:, None]
    behind = above + 0.008 * (np.arange(200) + 0.5) / 200
    points = camera.lift(np.stack([columns, rows], -1)[:, None], behind)
    inside = np.all((points >= low) & (points <= [*high[:2], np.inf]), -1)
    swept = (behind**2 * 0.008 / 200 * inside).sum() / (camera.fx * camera.fy)
    assert np.isclose(body.volume.sum(), swept, rtol=0.02)


def test_a_flat_slab_up_to_the_back_has_its_volume_exactly(slab, camera):
    surface = slab(slope=0.0)
    body = thicken(surface, camera, Thickening(back=1.25))
    assert np.isclose(body.volume.sum(), 64 / 80 * 48 / 80 * 0.05**2 * 0.25 * 0.05, rtol=1e-5)


def test_nothing_stands_in_front_of_the_surface(slab, camera):
    surface = slab()
    body = thicken(surface, camera, Thickening())
    above, _, seen = surface.at(camera, body.rest.astype(float))
    assert np.all(body.rest[:, 2] >= above)
    assert np.all(seen)


def test_nothing_leaves_the_box(slab, camera):
    surface = slab()
    low, high = bounding_box(surface, camera)
    body = thicken(surface, camera, Thickening(back=1.3))
    assert np.all(body.rest >= low - 1e-7)
    assert np.all(body.rest <= high * [1, 1, 1.3] + 1e-7)


@pytest.mark.parametrize("per_cell", [8, 27])
def test_inner_cells_hold_the_density_asked_for(slab, camera, per_cell):
    body = thicken(slab(), camera, Thickening(per_cell=per_cell, most_particles=100000))
    cell = np.floor((body.rest - body.rest.mean(0)) / body.spacing).astype(int)
    _, counts = np.unique(cell, axis=0, return_counts=True)
    assert abs(np.median(counts) / per_cell - 1) < 0.3
    assert np.isclose(np.median(body.volume), body.spacing**3 / per_cell, rtol=0.1)


def test_too_many_particles_make_the_grid_coarser(slab, camera):
    said = []
    body = thicken(
        slab(), camera, Thickening(cells=40, most_particles=3000), progress=lambda d, t, text: said.append(text)
    )
    assert 2000 < len(body.rest) <= 3000
    assert any("too many" in text for text in said)


def test_the_back_and_the_border_are_held_and_the_middle_is_not(slab, camera):
    surface = slab(slope=0.0)
    body = thicken(surface, camera, Thickening())
    middle = np.all(np.abs(body.rest[:, :2]) < 0.008, 1)
    rear = body.rest[:, 2] > body.rest[:, 2].max() - body.spacing / 4
    assert body.held[rear].all()
    assert not body.held[middle & ~rear].any()
    edge = np.abs(body.rest[:, 0]) > np.abs(body.rest[:, 0]).max() - body.spacing / 4
    assert body.held[edge].all()
    free = thicken(surface, camera, Thickening(held_border=0))
    assert not free.held[edge & ~rear].any()


def test_every_column_has_one_surface_particle_on_top(slab, camera):
    body = thicken(slab(slope=0.0), camera, Thickening())
    _, which = np.unique(np.round(body.rest[:, :2], 7), axis=0, return_inverse=True)
    assert np.all(np.bincount(which, body.surface) == 1)
    top = np.full(which.max() + 1, np.inf)
    np.minimum.at(top, which, body.rest[:, 2])
    assert np.array_equal(body.surface, body.rest[:, 2] == top[which])


def test_what_is_inside_has_the_colour_of_the_surface_in_front_of_it(slab, camera):
    surface = slab()
    body = thicken(surface, camera, Thickening())
    above, _, _ = surface.at(camera, body.rest.astype(float))
    assert np.allclose(body.color[:, 0] * surface.z.max(), above, atol=2e-4)


def test_a_hole_the_instrument_left_is_filled(slab, camera):
    cover = np.ones((48, 64))
    cover[15:30, 25:40] = 0
    whole, holed = (thicken(s, camera, Thickening()) for s in (slab(), slab(cover=cover)))
    assert np.isclose(holed.volume.sum(), whole.volume.sum(), rtol=0.02)


def test_one_wrong_depth_makes_no_spike(slab, camera):
    flat, bumped = slab(), slab(bumps=-0.03)
    assert np.abs(bumped.z - flat.z)[10:-10, 10:-10].max() < 2e-4


def test_a_loose_piece_is_dropped_and_said(slab, camera):
    rng = np.random.default_rng(0)
    rest = np.concatenate([rng.random((400, 3)), rng.random((20, 3)) * 0.1 + [3, 0, 0]])
    whole, pieces = largest_piece(rest, 0.2)
    assert pieces == 2
    assert np.array_equal(whole, np.arange(420) < 400)


def test_the_printed_algorithm_fills_in_front_of_the_surface(slab, camera):
    surface = slab()
    rows, columns = np.mgrid[0:48:2, 0:64:2].reshape(2, -1)
    centers = camera.lift(np.stack([columns, rows], -1), surface.z[rows, columns])
    body = thicken(surface, camera, Thickening(method="literal"), centers=centers)
    above, _, _ = surface.at(camera, body.rest.astype(float))
    assert np.mean(body.rest[:, 2] < above) > 0.9


def test_the_same_scene_makes_the_same_body(slab, camera):
    a, b = (thicken(slab(), camera, Thickening()) for _ in range(2))
    assert a.rest.tobytes() == b.rest.tobytes()


def test_a_scene_out_of_view_is_refused(slab):
    with pytest.raises(Problem, match="covers no pixel"):
        slab(cover=np.zeros((48, 64)))
