"""Masses and springs against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from slab import slab

from surgisim.baselines import mesh, point_cloud
from surgisim.baselines.springs import SAFETY, Network, masses, spread, stable_step, swing
from surgisim.mpm.grip import Drive
from surgisim.problem import Problem
from surgisim.skin import skin, watertight, width

E = 1000.0


def free(count, frames, per_frame, step, anchors=1):
    """A drive that holds nothing."""
    path, hold = np.zeros((anchors, (frames - 1) * per_frame + 1, 3)), np.ones((anchors, (frames - 1) * per_frame))
    spring, center = np.zeros((anchors, 3, 3)), np.zeros((anchors, 3))
    return Drive(np.zeros(count, np.int32), np.zeros(count), path, hold, step, per_frame, spring, center)


def block(size=(0.04, 0.04, 0.04), per_axis=2):
    return slab(size=size, spacing=0.005, per_axis=per_axis)


@pytest.mark.parametrize("axis", [0, 2])
def test_a_cloud_stretches_as_its_modulus_says(axis):
    """Energy of a small stretch whose sides give way by a quarter: E e^2 V / 2; particles at the sides lack springs."""
    body = block()
    net, e = point_cloud.network(body, E), 1e-3
    strain = np.full(3, -0.25 * e)
    strain[axis] = e
    wanted = 0.5 * E * e**2 * body.volume.sum()
    assert net.energy(net.place * strain) == pytest.approx(wanted, rel=0.08)
    # Sheared, mu = E / 2.5.
    u = np.zeros_like(net.place)
    u[:, axis] = e * net.place[:, 1]
    assert net.energy(u) == pytest.approx(0.5 * E / 2.5 * e**2 * body.volume.sum(), rel=0.2)


def test_a_mesh_is_closed_and_its_skin_stretches_as_its_modulus_says():
    body = block(size=(0.06, 0.06, 0.02))
    wide, faces = width(body), skin(body)
    assert watertight(faces)
    corners = body.rest[faces].astype(float)
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    sides = np.array([0.06, 0.06, 0.02]) - wide
    assert area == pytest.approx(2 * (sides[0] * sides[1] + sides[0] * sides[2] + sides[1] * sides[2]), rel=0.02)
    # All sides alike: E t e^2 A / (1 - 1/3).
    net, e = mesh.network(body, E), 1e-3
    assert net.energy(net.place * e) == pytest.approx(1.5 * E * wide * e**2 * area, rel=1e-6)


def test_without_anchors_momentum_stays_and_energy_too_but_what_is_viscous_loses_it():
    net = point_cloud.network(block(), E)
    mass = np.full(len(net.place), 1050.0 * 0.04**3 / len(net.place))
    start = 1e-3 * np.random.default_rng(0).standard_normal(net.place.shape)
    start[:, 2] += 0.05 * (net.place[:, 2] - net.place[:, 2].mean())
    for lag in (0.0, 2e-3):
        step = 0.05 * stable_step(net, mass, lag)
        done = swing(net, mass, lag, free(len(mass), 20, 200, step), start=start)
        total = done.energy.sum(1)
        assert np.abs((mass[:, None] * done.v).sum(1)).max() < 1e-9 * np.abs(mass[:, None] * done.v).sum(1).max()
        if lag:
            assert total[-1] < 0.5 * total[0]
        else:
            assert np.abs(total - total[0]).max() < 0.01 * total[0]


def test_two_masses_swing_at_their_frequency():
    """Apart by little, at rest: x = a cos(w t), w^2 = 2 k / m."""
    net = Network(np.arange(2), np.array([[0.0, 0, 0], [0.01, 0, 0]]), np.array([[0, 1]]), np.array([50.0]))
    mass, start = np.full(2, 1e-3), np.array([[0.0, 0, 0], [1e-4, 0, 0]])
    frequency = np.sqrt(2 * 50.0 / 1e-3)
    assert stable_step(net, mass, 0.0) == pytest.approx(2 / frequency / np.sqrt(1.0))
    step = 0.01 / frequency
    done = swing(net, mass, 0.0, free(2, 30, 25, step), start=start)
    apart = done.u[:, 1, 0] - done.u[:, 0, 0]
    clock = np.arange(30) * 25 * step
    # Symplectic Euler begins half a step late.
    assert np.allclose(apart, 1e-4 * np.cos(frequency * clock), atol=2e-6)


def test_the_step_is_stable_and_one_that_is_far_too_long_is_said_not_to_be():
    net = point_cloud.network(block(), E)
    mass = np.full(len(net.place), 1e-5)
    start = 1e-4 * np.random.default_rng(0).standard_normal(net.place.shape)
    for lag in (0.0, 5e-3):
        step = SAFETY * stable_step(net, mass, lag)
        done = swing(net, mass, lag, free(len(mass), 5, 200, step), start=start)
        assert done.energy.sum(1)[-1] < 1.5 * done.energy.sum(1)[0]
    with pytest.raises(Problem, match="not finite at frame"):
        swing(net, mass, 0.0, free(len(mass), 40, 400, 8 * stable_step(net, mass, 0.0)), start=start)


def test_all_of_the_mass_is_kept_and_what_is_no_mass_goes_with_those_beside_it():
    body = block(size=(0.06, 0.06, 0.02))
    net = mesh.network(body, E)
    particles = 1050.0 * body.volume.astype(float)
    assert masses(net, body.rest.astype(float), particles).sum() == pytest.approx(particles.sum())
    along = spread(net, body.rest.astype(float))
    assert np.allclose(along.sum(1), 1)
    u = np.random.default_rng(0).standard_normal(net.place.shape)
    assert np.allclose((along @ u)[net.vertices], u, atol=1e-6)


def test_nothing_to_join_is_said():
    body = block()
    far = body.rest.astype(float) * 10
    with pytest.raises(Problem, match="no two of"):
        point_cloud.network(replace(body, rest=far), E)
