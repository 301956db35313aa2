"""The light of moving tissue tells how its surface turns and comes nearer."""

from dataclasses import replace

import numpy as np
import pytest
from slab import pulled, slab

from surgisim.estimation.brightness import Brightness, _whitened, carry_of, headlight, tangents_of
from surgisim.estimation.light_along_tracks import brightness
from surgisim.estimation.whiten import inverse_root
from surgisim.lighting.headlight import MATTE
from surgisim.mpm.setup import prepare

LAWS = {"corotated": {"E": 900.0, "nu": 0.4}, "newtonian": {"eta": 1.0}}
T = 12
COURSE = np.clip(np.arange(T) / 5, 0, 1)


def moved(by):
    """A slab under a pull, and a lattice of points of its face, in front of the grip's own."""
    body, motion = slab(), pulled(frames=T, hold=T, by=by)
    made = prepare(body, tuple(LAWS), density=1050.0, grips=motion)
    run = made.simulator.run(
        made.theta(LAWS), made.drive(motion, LAWS, fps=25.0, per_frame=2 * made.per_frame(LAWS, 25.0))
    )
    x, y = np.meshgrid(np.linspace(-0.018, 0.018, 13), np.linspace(-0.012, 0.012, 9))
    rest = np.stack([x.ravel(), y.ravel(), np.full(x.size, 0.0602)], -1)
    return made.simulator, run.u, rest[np.hypot(rest[:, 0], rest[:, 1]) > 0.007]


def of(simulator, rest, seen=None):
    k = len(rest)
    tangents = tangents_of(rest)
    return Brightness(
        rest, tangents, np.zeros((k, T)) if seen is None else seen, np.full((k, T), 1 / 0.03), np.zeros((k, 1)), COURSE,
        0.003, 0.02, carry_of(simulator, rest, tangents, 0.003),
    )  # fmt: skip


def test_a_surface_that_comes_nearer_brightens_with_the_distance_squared():
    at, normal = np.array([[0.0, 0.0, 0.06], [0.01, 0.0, 0.08]]), np.array([[0.0, 0.0, -1.0], [0.0, 0.0, -1.0]])
    turning, nearer = headlight(at, normal, 0.9 * at, normal)
    assert turning == pytest.approx(0.0, abs=1e-12)
    assert nearer == pytest.approx(-2 * np.log(0.9), abs=1e-12)


def test_a_surface_that_turns_away_darkens_with_the_cosine():
    at, normal = np.array([0.0, 0.0, 0.06]), np.array([0.0, 0.0, -1.0])
    turned = np.array([np.sin(0.5), 0.0, -np.cos(0.5)])
    turning, nearer = headlight(at, normal, at, turned)
    assert turning == pytest.approx(np.log(np.cos(0.5)))
    assert nearer == pytest.approx(0.0)


def test_what_is_left_has_the_squares_that_the_inverse_covariance_gives():
    rng = np.random.default_rng(0)
    columns, modes, size = rng.normal(size=(6, 4, 2)), rng.normal(size=(6, 3)), rng.random((6, 4))
    of_modes = (modes[:, None] * size[..., None]).reshape(24, 3)
    B = np.concatenate([columns.reshape(24, 2), of_modes], -1)
    inner = inverse_root(of_modes.T @ of_modes)
    for r in rng.normal(size=(5, 6, 4)):
        left = _whitened(r, columns, modes, size, inner)
        assert (left**2).sum() == pytest.approx(r.ravel() @ np.linalg.solve(np.eye(24) + B @ B.T, r.ravel()))


def test_the_right_pull_explains_the_light_and_one_along_the_surface_does_not():
    simulator, u, rest = moved((0.003, 0.0, -0.006))
    frames = np.arange(1, T)
    turning, nearer, *_ = of(simulator, rest)._changes(u, frames)
    assert np.abs(turning).max() > 0.1
    seen = np.zeros((len(rest), T))
    seen[:, frames] = MATTE * turning + nearer
    assert np.abs(of(simulator, rest, seen).residual(u, frames)).max() < 1e-9
    flat, level, same = moved((0.003, 0.0, 0.0))
    assert (same == rest).all()
    assert (of(flat, rest, seen).residual(level, frames) ** 2).mean() > 1.0


def test_how_matte_the_tissue_is_and_how_it_leans_hardly_count():
    simulator, u, rest = moved((0.003, 0.0, -0.006))
    frames = np.arange(1, T)
    turning, nearer, across, _ = of(simulator, rest)._changes(u, frames)
    seen = np.zeros((len(rest), T))
    seen[:, frames] = (MATTE - 0.2) * turning + nearer + 0.1 * across
    light = of(simulator, rest, seen)
    bare = light.weight[:, frames] * (MATTE * turning + nearer - seen[:, frames])
    assert (light.residual(u, frames) ** 2).sum() < 0.1 * (bare**2).sum()


def test_exposure_is_read_off_still_tissue_and_spoilt_pixels_do_not_count():
    simulator, _, rest = moved((0.003, 0.0, 0.0))
    rgb = np.full((T, 60, 80, 3), 120, np.uint8)
    rgb[6:] = 140
    x, y = np.meshgrid(np.arange(6, 76, 6), np.arange(6, 56, 6))
    start = np.stack([x.ravel(), y.ravel()], -1).astype(float)[: len(rest)]
    xy = np.repeat(start[:, None], T, 1)
    going = np.arange(len(start)) < 20
    xy[going, 1:, 0] += 3 * COURSE[1:]
    spoilt = np.zeros(rgb.shape[:3], bool)
    spoilt[8, :30] = True
    light = brightness(
        rgb, spoilt, rest[: len(start)], xy, np.ones(xy.shape[:2], bool), COURSE, simulator, step=0.003,
        independent=0.02,
    )  # fmt: skip
    assert len(light.rest) == 20
    assert np.abs(light.seen).max() < 1e-6
    assert not light.weight[xy[going, 8, 1] < 28, 8].any()
    assert light.weight[:, 4].all()


def test_without_still_tissue_light_is_left_aside():
    simulator, _, rest = moved((0.003, 0.0, 0.0))
    xy = np.repeat(np.stack([np.linspace(5, 70, len(rest)), np.full(len(rest), 30.0)], -1)[:, None], T, 1)
    xy[:, 1:, 1] += 5.0
    rgb = np.full((T, 60, 80, 3), 120, np.uint8)
    nothing = np.zeros(rgb.shape[:3], bool)
    seen = np.ones(xy.shape[:2], bool)
    assert brightness(rgb, nothing, rest, xy, seen, COURSE, simulator, step=0.003, independent=0.02) is None


def test_a_point_beside_a_grip_is_on_the_body():
    simulator, _, rest = moved((0.003, 0.0, 0.0))
    near = rest[np.hypot(rest[:, 0], rest[:, 1]) < 0.010]
    assert simulator.support(simulator.carry(near)) == pytest.approx(1.0)
    assert np.abs(np.asarray(simulator.carry(near).sum(1)).ravel() - 1).max() > 0.05


def test_light_follows_its_points_to_another_view():
    simulator, _, rest = moved((0.003, 0.0, 0.0))
    light = of(simulator, rest)
    tilted = rest + np.outer(0.2 * rest[:, 0], [0.0, 0.0, 1.0])
    assert light.placed(tilted).tangents[:, 0, 2] == pytest.approx(0.2, abs=0.01)
    assert replace(light, rest=rest).tangents[:, 0, 2] == pytest.approx(0.0, abs=1e-9)


def test_places_along_a_fold_stay_beside_its_points():
    rng = np.random.default_rng(0)
    rest = np.concatenate([rng.uniform(-0.01, 0.01, (80, 2)), np.full((80, 1), 0.05)], 1)
    rest[:, 2] += 5 * rest[:, 0]
    tangents = tangents_of(rest)
    assert np.linalg.norm(tangents, axis=-1) == pytest.approx(1.0)
    assert np.abs(tangents[:, 0, 2]).min() > 0.9
