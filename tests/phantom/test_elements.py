"""The finite elements against theory: energy, patch, beam, bar."""

import numpy as np
import pytest
from tissue_pieces import box

from surgisim.phantom.elements import SLOPES, elements
from surgisim.phantom.forces import add_forces
from surgisim.phantom.law import Law
from surgisim.phantom.march import advance, stable_step

TISSUE = Law(E=1000.0, nu=0.45, eta=4.0, density=1050.0)


def arrays(parts):
    return parts.cells, parts.inverse, parts.weight, parts.mu, parts.lam, parts.eta


def forces(x, v, parts):
    out = np.zeros_like(x)
    add_forces(x, v, *arrays(parts), out)
    return out


class Twin:
    """The same elements, slowly, in numpy."""

    def __init__(self, points, cells, law):
        jacobian = np.einsum("mai,gak->mgik", points[cells], SLOPES)
        self.cells, self.law, self.w = cells, law, np.linalg.det(jacobian)
        self.b = np.einsum("gak,mgkj->mgaj", SLOPES, np.linalg.inv(jacobian))

    def gradient(self, field):
        return np.einsum("mai,mgaj->mgij", field[self.cells], self.b)

    def energy(self, x):
        F, rest = self.gradient(x), self.w.sum(1)
        J = np.linalg.det(F)
        theta = (self.w * J).sum(1) / rest
        shear = self.law.mu / 2 * ((F**2).sum((-1, -2)) - 3 - 2 * np.log(J))
        return (self.w * shear).sum() + (rest * self.law.lam / 4 * (theta**2 - 1 - 2 * np.log(theta))).sum()

    def viscous(self, x, v):
        F, R = self.gradient(x), self.gradient(v)
        turn = np.linalg.inv(F)
        D = (R @ turn + (R @ turn).swapaxes(-1, -2)) / 2
        P = np.linalg.det(F)[..., None, None] * 2 * self.law.eta * D @ turn.swapaxes(-1, -2)
        out = np.zeros_like(x)
        np.add.at(out, self.cells, -np.einsum("mg,mgij,mgaj->mai", self.w, P, self.b))
        return out


@pytest.fixture
def crooked():
    """Five crooked elements of seven nodes' width, bent, and moving."""
    rng = np.random.default_rng(1)
    points, cells = box((2, 2, 2), (2.0, 2.0, 2.0))
    points += rng.uniform(-0.15, 0.15, points.shape)
    return points, cells[:5], points + rng.uniform(-0.1, 0.1, points.shape), rng.standard_normal(points.shape)


def test_elastic_forces_are_the_slope_of_the_energy(crooked):
    points, cells, x, v = crooked
    twin, step, slope = Twin(points, cells, TISSUE), 1e-5, np.zeros_like(x)
    for at in np.ndindex(*x.shape):
        nudge = np.zeros_like(x)
        nudge[at] = step
        slope[at] = (twin.energy(x + nudge) - twin.energy(x - nudge)) / (2 * step)
    found = forces(x, 0 * v, elements(points, cells, TISSUE))
    assert np.abs(found + slope).max() < 1e-8 * np.abs(slope).max()


def test_viscous_forces_are_those_of_2_eta_D(crooked):
    points, cells, x, v = crooked
    parts = elements(points, cells, TISSUE)
    found = forces(x, v, parts) - forces(x, 0 * v, parts)
    assert np.allclose(found, Twin(points, cells, TISSUE).viscous(x, v), atol=1e-12 * np.abs(found).max())


def test_turning_tissue_costs_nothing(crooked):
    points, cells, _, _ = crooked
    turn, _ = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    spin = np.cross([0.3, -1.0, 0.5], points @ turn.T)
    assert np.abs(forces(points @ turn.T, spin, elements(points, cells, TISSUE))).max() < 1e-10


@pytest.mark.parametrize("stretch", [0.7, 1.4])
def test_a_compressed_cube_pushes_back_as_the_formula_says(stretch):
    rng = np.random.default_rng(3)
    points, cells = box((3, 3, 3), (1.0, 1.0, 1.0))
    inside = ((points > 0.01) & (points < 0.99)).all(1)
    points[inside] += rng.uniform(-0.08, 0.08, (inside.sum(), 3))
    wide = _free_width(TISSUE, stretch)
    J = stretch * wide**2
    stress = TISSUE.mu * (stretch**2 - 1) / J + TISSUE.lam / 2 * (J - 1 / J)
    found = forces(points * [stretch, wide, wide], 0 * points, elements(points, cells, TISSUE))
    end = points[:, 0] == 1.0
    assert np.isclose(found[end, 0].sum(), -stress * wide**2, rtol=1e-10)
    assert np.abs(found[points[:, 0] % 1 != 0]).max() < 1e-10 * TISSUE.E


def _free_width(law, stretch):
    """Lateral stretch without lateral stress, by bisection."""
    low, high = 0.3, 3.0
    for _ in range(80):
        wide = (low + high) / 2
        J = stretch * wide**2
        pull = law.mu * (wide**2 - 1) / J + law.lam / 2 * (J - 1 / J)
        low, high = (wide, high) if pull < 0 else (low, wide)
    return wide


def stiffness(points, parts, free):
    """Of the free components (N, 3) about rest, by central differences."""
    columns, step, zero = [], 1e-6 * np.ptp(points), np.zeros_like(points)
    for at in np.argwhere(free):
        nudge = zero.copy()
        nudge[tuple(at)] = step
        columns.append((forces(points - nudge, zero, parts) - forces(points + nudge, zero, parts))[free])
    return np.array(columns).T / (2 * step)


def tip_sag(across, law):
    """Deflection of a cantilever's end under unit load over Timoshenko's, with `across` elements in the height."""
    length, height = 6.0, 1.0
    points, cells = box((6 * across, across, across), (length, height, height))
    points = points - [0, height / 2, height / 2]
    end = points[:, 0] == length
    load = np.zeros_like(points)
    # Parabolic shear, as the theory has it, so that nothing is disturbed at the loaded end.
    load[end, 2] = _tributary(points[end]) * (1 - (2 * points[end, 2] / height) ** 2 + 0.5 / across**2)
    load /= load.sum()
    # The root may contract sideways, as the theory's does.
    free = np.repeat(points[:, :1] > 0, 3, 1) | (np.abs(points) > 1e-9)
    sag = np.zeros_like(points)
    sag[free] = np.linalg.solve(stiffness(points, elements(points, cells, law), free), load[free])
    bend = length**3 / (3 * law.E * height**4 / 12)
    shear = length / (law.mu * height**2 * 10 * (1 + law.nu) / (12 + 11 * law.nu))
    return sag[end, 2].mean() / (bend + shear)


def _tributary(face):
    share = np.ones(len(face))
    for axis in (1, 2):
        share *= np.where(np.abs(face[:, axis]) == np.abs(face[:, axis]).max(), 0.5, 1.0)
    return share


@pytest.mark.parametrize("nu", [0.3, 0.47])
def test_a_cantilever_sags_as_beam_theory_says_and_better_with_finer_elements(nu):
    law = Law(E=1000.0, nu=nu, eta=0.0, density=1000.0)
    coarse, fine = (1 - tip_sag(across, law) for across in (2, 4))
    assert 0 < fine < 0.02
    assert fine < 0.3 * coarse


def test_a_bar_rings_at_its_own_frequency():
    law = Law(E=1000.0, nu=0.0, eta=0.0, density=1000.0)
    points, cells = box((16, 1, 1), (0.16, 0.01, 0.01))
    parts, fixed = elements(points, cells, law), points[:, 0] == 0
    dt = 0.5 * stable_step(points, parts, fixed)
    pull = np.where(fixed, 0.0, dt / parts.mass)
    x, v = points.copy(), np.zeros_like(points)
    v[:, 0] = 1e-4 * np.sin(np.pi / 2 * points[:, 0] / 0.16)
    none, still = np.zeros(0, int), np.zeros((2, 3))
    tip = []
    for _ in range(3000):
        advance(x, v, points, pull, none, still, np.zeros(1, bool), dt, *arrays(parts), np.zeros_like(x))
        tip.append(x[-1, 0] - 0.16)
    sign = np.flatnonzero(np.diff(np.sign(tip)))
    period = 2 * dt * (sign[-1] - sign[0]) / (len(sign) - 1)
    assert period == pytest.approx(4 * 0.16 / np.sqrt(law.E / law.density), rel=0.005)


@pytest.mark.parametrize("eta", [0.0, 4.0])
def test_energy_is_kept_without_viscosity_and_lost_with_it(eta):
    law = Law(E=1000.0, nu=0.45, eta=eta, density=1050.0)
    points, cells = box((4, 4, 4), (0.02, 0.02, 0.02))
    parts, twin = elements(points, cells, law), Twin(points, cells, law)
    fixed = points[:, 2] == 0
    dt = 0.2 * stable_step(points, parts, fixed)
    pull = np.where(fixed, 0.0, dt / parts.mass)
    x, v = points.copy(), 0.15 * np.sin(points[:, 2:] * 80) * np.array([1.0, 0.3, -0.5])
    energy = []
    for _ in range(40):
        before = v.copy()
        at = twin.energy(x)
        advance(
            x, v, points, pull, np.zeros(0, int), np.zeros((2, 3)), np.zeros(1, bool), dt, *arrays(parts), 0 * points
        )
        energy.append(at + (parts.mass[:, None] * ((before + v) / 2) ** 2).sum() / 2)
        advance(
            x, v, points, pull, np.zeros(0, int), np.zeros((11, 3)), np.zeros(10, bool), dt, *arrays(parts), 0 * points
        )
    energy = np.array(energy[1:])
    if eta == 0:
        assert np.ptp(energy) < 0.01 * energy[0]
    else:
        assert (np.diff(energy) < 1e-4 * energy[0]).all()
        assert energy[-1] < 0.5 * energy[0]
