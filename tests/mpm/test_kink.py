"""The displacement may bend at a grip's skin, and nothing else changes."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from slab import pulled, slab
from test_engine import FPS, SOFT, free

from surgisim.mpm.setup import prepare

BODY = slab(size=(0.036, 0.03, 0.018))


@pytest.fixture
def sharp():
    return prepare(BODY, tuple(SOFT), density=1050.0, grips=pulled())


def test_splines_and_kinks_have_nothing_in_common(sharp):
    weights = sharp.simulator.carry(BODY.rest.astype(float)).toarray()
    plain = sharp.simulator.rule.shape[1]
    overlap = weights[:, :plain].T @ (BODY.volume[:, None] * weights[:, plain:])
    alone = np.sqrt((BODY.volume[:, None] * weights[:, plain:] ** 2).sum(0) * BODY.volume.sum())
    assert (np.abs(overlap).max(0) < 2e-3 * alone).all()


@pytest.mark.parametrize("skin", [0.0, 1.0])
def test_a_kinks_gradient_is_its_slope(skin):
    sharp = prepare(BODY, tuple(SOFT), density=1050.0, grips=pulled(), skin=skin)
    rng, h = np.random.default_rng(0), 1e-7
    points = np.array([0.0, 0.0, 0.066]) + rng.uniform(-0.009, 0.009, (40, 3)) * [1, 1, 0.5]
    simulator = sharp.simulator

    def dense(x):
        return simulator.carry(x).toarray()

    index, link = simulator.links(points)
    for axis in range(3):
        step = h * np.eye(3)[axis]
        slope = (dense(points + step) - dense(points - step)) / (2 * h)
        found = np.zeros_like(slope)
        np.add.at(found, (np.arange(len(points))[:, None], index), link[..., 1 + axis])
        assert np.allclose(found, slope, atol=1e-4 / BODY.spacing)


def test_far_from_every_grip_there_are_no_kinks(sharp):
    corner = BODY.rest[np.linalg.norm(BODY.rest - pulled().center_rest[0], axis=1) > 0.0255].astype(float)
    assert len(corner)
    assert not sharp.simulator.carry(corner)[:, sharp.simulator.rule.shape[1] :].toarray().any()


def test_a_gripped_body_falls_as_freely_as_any_other():
    made = prepare(BODY, tuple(SOFT), density=1050.0, grips=pulled(), gravity=(0.0, 9.81, 0.0))
    nothing = np.zeros(len(BODY.rest), bool)
    path = made.drive(free(BODY), SOFT, fps=FPS, per_frame=made.per_frame(SOFT, FPS), held=nothing)
    out, plain = made.simulator.run(made.theta(SOFT), path), made.simulator.rule.shape[1]
    time = (len(out.u) - 1) / FPS
    assert np.allclose(out.u[-1][:plain, 1], 9.81 * time * (time + path.step) / 2, rtol=1e-4)
    assert np.abs(out.u[-1][plain:]).max() < 1e-6


def test_the_gripped_ball_stays_rigid_and_the_tissue_beside_it_does_not(sharp):
    motion = pulled()
    path = sharp.drive(motion, SOFT, fps=FPS, per_frame=sharp.per_frame(SOFT, FPS))
    u = sharp.simulator.run(sharp.theta(SOFT), path).u[8].astype(float)
    radius, wanted = motion.radius[0], np.linalg.norm(motion.position[0, 8] - motion.center_rest[0])
    line = motion.center_rest + np.array([0.3, 0.6, 1.0, 1.4])[:, None] * radius * [1.0, 0, 0] + [0, 0, 1e-4]
    along = np.linalg.norm(sharp.simulator.carry(line) @ u, axis=1)
    assert along[:2] == pytest.approx(wanted, rel=0.06)
    assert along[2] - along[3] > 3 * (along[0] - along[1])


def test_the_adjoint_sees_the_kinks():
    made = prepare(BODY, tuple(SOFT), density=1050.0, grips=pulled(), precision="double")
    motion = pulled(frames=8, hold=5)
    path = made.drive(motion, SOFT, fps=FPS, per_frame=made.per_frame(SOFT, FPS, 0.8))
    theta, rng = made.theta(SOFT), np.random.default_rng(0)
    run = made.simulator.run(theta, path)
    c = rng.standard_normal(run.u.shape)
    gradient = made.simulator.gradient(theta, path, run, c).theta
    along = rng.random(theta.shape) * theta * 1e-4
    up, down = (made.simulator.run(theta + s * along, path).u for s in (1, -1))
    assert (gradient * along).sum() == pytest.approx((c * (up - down)).sum() / 2, rel=1e-5)


def test_a_grip_smaller_than_a_cell_carries_what_a_finer_grid_says():
    motion, size = pulled(), (0.036, 0.03, 0.018)
    line = motion.center_rest + np.array([1.6, 2.0, 2.5])[:, None] * motion.radius[0] * [1.0, 0, 0] + [0, 0, 1e-4]
    found = []
    for cells in (0.65, 1.6):
        made = prepare(
            slab(size=size, spacing=motion.radius[0] / cells), tuple(SOFT), density=1050.0, grips=motion, carried=line
        )
        path = made.drive(motion, SOFT, fps=FPS, per_frame=made.per_frame(SOFT, FPS))
        found.append(made.simulator.carry(line) @ made.simulator.run(made.theta(SOFT), path).u[8].astype(float))
    wanted = np.linalg.norm(motion.position[0, 8] - motion.center_rest[0])
    # Widened to a cell it would be off by half of that.
    assert np.abs(found[0] - found[1]).max() < 0.12 * wanted


def test_a_grip_with_a_skin_can_be_moved_a_little_without_a_jump():
    points = BODY.rest[BODY.surface].astype(float)

    def replayed(skin, aside):
        motion = pulled()
        move = np.array([aside, 0.0, 0.0])
        motion = replace(motion, center_rest=motion.center_rest + move, position=motion.position + move)
        made = prepare(BODY, tuple(SOFT), density=1050.0, carried=points, grips=motion, skin=skin)
        path = made.drive(motion, SOFT, fps=FPS, per_frame=80)
        return made.simulator.carry(points) @ made.simulator.run(made.theta(SOFT), path, last=6).u[-1].astype(float)

    def jump(skin):
        """Largest change of the response from one of many small moves to the next, over the mean one."""
        moved = [replayed(skin, 1e-4 * k) for k in range(9)]
        steps = [np.abs(b - a).mean() for a, b in itertools.pairwise(moved)]
        return max(steps) / np.mean(steps)

    assert jump(1.0) < 2.0
    assert jump(1.0) < jump(0.0)
