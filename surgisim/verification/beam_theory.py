"""Free vibration of rods and beams.

Axial: Love's rod, omega = c k / sqrt(1 + (nu k r)^2), c = sqrt(E / rho), r the polar radius of gyration.
Love, A Treatise on the Mathematical Theory of Elasticity (1927), section 278.

Bending: Timoshenko's beam by Rayleigh and Ritz on Legendre polynomials, with Cowper's shear coefficient;
Euler and Bernoulli's for comparison. Cowper, The shear coefficient in Timoshenko's beam theory, 1966.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Legendre
from scipy.linalg import eigh

DEGREE = 14
EULER = {"free": 4.730040745, "clamped": 1.875104069}
"""First root of cos x cosh x = 1 (free at both ends) and of cos x cosh x = -1 (clamped at one)."""


@dataclass(frozen=True)
class Square:
    """A rod of square section."""

    length: float
    """[m]"""
    side: float
    """[m]"""
    E: float
    """[Pa]"""
    nu: float
    density: float
    """[kg/m^3]"""

    @property
    def speed(self) -> float:
        """Of a long rod's axial wave [m/s]."""
        return float(np.sqrt(self.E / self.density))


def axial(rod: Square, ends: str) -> float:
    """First axial frequency [Hz] of a rod that is free at both ends ('free'), or clamped at one ('clamped')."""
    k = np.pi / rod.length / (1 if ends == "free" else 2)
    return float(rod.speed * k / np.sqrt(1 + (rod.nu * k * rod.side) ** 2 / 6) / (2 * np.pi))


def euler(rod: Square, ends: str) -> float:
    """First bending frequency [Hz] after Euler and Bernoulli."""
    k = EULER[ends] / rod.length
    return float(k**2 * rod.speed * rod.side / np.sqrt(12) / (2 * np.pi))


@dataclass(frozen=True)
class Bending:
    """First bending mode: centre line w(x), turning of the sections phi(x), x from 0 to the length."""

    frequency: float
    """[Hz]"""
    w: Legendre
    phi: Legendre


def timoshenko(rod: Square, ends: str) -> Bending:
    """First bending mode after Timoshenko."""
    shear = 10 * (1 + rod.nu) / (12 + 11 * rod.nu) * rod.E / (2 * (1 + rod.nu)) * rod.side**2
    area, inertia = rod.side**2, rod.side**4 / 12
    domain = [0, rod.length]
    basis = [Legendre.basis(n, domain) for n in range(DEGREE)]
    if ends == "clamped":
        x = Legendre.identity(domain) / rod.length
        basis = [x * p for p in basis]
    points, weights = np.polynomial.legendre.leggauss(DEGREE + 2)
    points, weights = (points + 1) * rod.length / 2, weights * rod.length / 2
    value = np.stack([p(points) for p in basis])
    slope = np.stack([p.deriv()(points) for p in basis])
    none = np.zeros_like(value)
    gap = np.concatenate([slope, -value])
    bend = np.concatenate([none, slope])
    stiffness = (gap * weights * shear) @ gap.T + (bend * weights * rod.E * inertia) @ bend.T
    down, turn = np.concatenate([value, none]), np.concatenate([none, value])
    mass = rod.density * ((down * weights * area) @ down.T + (turn * weights * inertia) @ turn.T)
    first = 2 if ends == "free" else 0
    squares, modes = eigh(stiffness, mass)
    mode = modes[:, first] / np.abs(modes[:, first] @ down).max()
    w, phi = (sum(c * p for c, p in zip(part, basis, strict=True)) for part in np.split(mode, 2))
    return Bending(float(np.sqrt(squares[first]) / (2 * np.pi)), w, phi)


def axial_shape(rod: Square, ends: str, x: np.ndarray) -> np.ndarray:
    """First axial mode with its bulging at points [m], (A, 3); largest displacement 1 along x. Zero behind a clamp."""
    k = np.pi / rod.length / (1 if ends == "free" else 2)
    at = k * (x[:, 0] - (0 if ends == "free" else rod.length))
    along, strain = np.cos(at), -k * np.sin(at)
    shape = np.concatenate([along[:, None], -rod.nu * strain[:, None] * x[:, 1:]], 1)
    return shape if ends == "free" else shape * (x[:, :1] > 0)


def bending_shape(rod: Square, ends: str, x: np.ndarray) -> np.ndarray:
    """First bending mode across z at points [m], (A, 3); largest displacement 1. Zero behind a clamp."""
    mode = timoshenko(rod, ends)
    shape = np.stack([-mode.phi(x[:, 0]) * x[:, 2], np.zeros(len(x)), mode.w(x[:, 0])], 1)
    return shape if ends == "free" else shape * (x[:, :1] > 0)
