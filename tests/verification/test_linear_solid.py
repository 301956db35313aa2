"""The closed forms themselves, against limits and against each other."""

import numpy as np
import pytest

from surgisim.verification.beam_theory import Square, axial, euler, timoshenko
from surgisim.verification.linear_solid import LinearSolid
from surgisim.verification.vibration import vibration


def test_a_held_solid_relaxes_from_its_fast_to_its_slow_modulus():
    time = np.linspace(0, 3, 3001)
    strain = np.where(time > 0, 1e-3, 0.0)
    stress = LinearSolid(1000.0, branches=((500.0, 0.4),)).stress(time, strain)
    assert np.allclose(stress[1:], 1.0 + 0.5 * np.exp(-time[1:] / 0.4), rtol=1e-3)


def test_a_hanging_rod_comes_to_rest_at_the_sag_of_its_slow_modulus():
    time, x = np.linspace(0, 8, 2001), np.array([0.05, 0.1])
    solid = LinearSolid(1000.0, eta=50.0, branches=((500.0, 0.4),))
    sag = 1000.0 * 9.81 * (0.1 * x - x**2 / 2) / 1000.0
    assert np.allclose(solid.hung(time, x, 0.1, 1000.0, 9.81)[-1], sag, rtol=1e-3)


def test_a_rod_whose_shear_relaxes_has_one_branch_that_is_slower():
    E, nu, g, tau = 3000.0, 0.3, 700.0, 0.2
    solid = LinearSolid.of_shear(E, nu, g, tau)
    (modulus, slower), mu, K = solid.branches[0], E / 2.6, E / 1.2
    for s in (0.1, 3.0, 50.0):
        shear = mu + g * s * tau / (1 + s * tau)
        assert E + modulus * s * slower / (1 + s * slower) == pytest.approx(9 * K * shear / (3 * K + shear))


def test_a_slender_beam_bends_after_euler_and_bernoulli():
    thin = Square(1.0, 0.01, 1e4, 0.3, 1000.0)
    for ends in ("free", "clamped"):
        assert timoshenko(thin, ends).frequency == pytest.approx(euler(thin, ends), rel=2e-3)
    assert axial(thin, "clamped") == pytest.approx(np.sqrt(10.0) / 4, rel=1e-4)


def test_a_decaying_cosine_is_read_off():
    time = np.linspace(0, 1, 200)
    q = 0.3 + 2 * np.exp(-0.7 * time) * np.cos(40 * time - 1)
    found = vibration(time, q, 43.0, about=True)
    assert (found.omega, found.decay, found.amplitude) == pytest.approx((40, 0.7, 2))
