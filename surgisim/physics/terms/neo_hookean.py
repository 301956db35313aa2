"""Compressible neo-Hookean elasticity: rubber, and tissue stretched further than a spring.

    psi = mu/2 (tr(F^T F) - 3) - mu ln J + lambda/2 (ln J)^2          [J/m^3]
    sigma = (mu (F F^T - I) + lambda ln J I) / J                      [Pa]

J = det F, mu = E / (2 (1 + nu)), lambda = E nu / ((1 + nu) (1 - 2 nu)).
Bonet and Wood, Nonlinear continuum mechanics for finite element analysis, 2nd ed. (2008), section 6.4.3.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.terms.corotated import lame, moduli, wave_modulus


@wp.func
def stress(F: Any, D: Any, theta: Any):
    mu, lam = moduli(theta)
    J = wp.determinant(F)
    one = wp.identity(n=3, dtype=F.dtype)
    return (mu * (F * wp.transpose(F) - one) + lam * wp.log(J) * one) / J


def twin(F, D, E, nu):
    mu, lam = lame(E, nu)
    J = np.linalg.det(F)[..., None, None]
    return (mu * (F @ np.swapaxes(F, -1, -2) - np.eye(3)) + lam * np.log(J) * np.eye(3)) / J


def energy(F, E, nu):
    mu, lam = lame(E, nu)
    log_j = np.log(np.linalg.det(F))
    return mu / 2 * ((F**2).sum((-1, -2)) - 3) - mu * log_j + lam / 2 * log_j**2


TERM = Term(
    stress=stress,
    twin=twin,
    energy=energy,
    wave_modulus=wave_modulus,
    params={
        "E": Param("Pa", low=1e2, high=1e6, default=3e3, off=0.0),
        "nu": Param("1", low=0.05, high=0.48, default=0.45, logarithmic=False),
    },
)
