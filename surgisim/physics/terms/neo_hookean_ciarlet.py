"""Compressible neo-Hookean elasticity with Ciarlet's volumetric energy, as the phantom's finite elements have it.

    psi = mu/2 (tr(F^T F) - 3 - 2 ln J) + lambda/4 (J^2 - 1 - 2 ln J)   [J/m^3]
    sigma = (mu (F F^T - I) + lambda/2 (J^2 - 1) I) / J                 [Pa]

J = det F, mu = E / (2 (1 + nu)), lambda = E nu / ((1 + nu) (1 - 2 nu)). To second order in strain it is
`neo_hookean`, whose lambda/2 (ln J)^2 is not convex beyond J = e; this one is polyconvex.
Ciarlet, Mathematical Elasticity I (1988), section 4.10; Wriggers, Nonlinear Finite Element Methods (2008), chapter 3.
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
    return (mu * (F * wp.transpose(F) - one) + F.dtype(0.5) * lam * (J * J - F.dtype(1.0)) * one) / J


def twin(F, D, E, nu):
    mu, lam = lame(E, nu)
    J = np.linalg.det(F)[..., None, None]
    return (mu * (F @ np.swapaxes(F, -1, -2) - np.eye(3)) + lam / 2 * (J**2 - 1) * np.eye(3)) / J


def energy(F, E, nu):
    mu, lam = lame(E, nu)
    J = np.linalg.det(F)
    return mu / 2 * ((F**2).sum((-1, -2)) - 3 - 2 * np.log(J)) + lam / 4 * (J**2 - 1 - 2 * np.log(J))


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
