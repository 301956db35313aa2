"""Fixed corotated elasticity: springs that turn with the tissue.

    psi = mu |F - R|^2 + lambda/2 (J - 1)^2                           [J/m^3]
    sigma = 2 mu / J (F - R) F^T + lambda (J - 1) I                   [Pa]

R is the rotation of F, J = det F, mu = E / (2 (1 + nu)), lambda = E nu / ((1 + nu) (1 - 2 nu)).
Stomakhin, Howes, Schroeder and Teran, Energetically consistent invertible elasticity, SCA 2012.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.rotation import rotation


@wp.func
def moduli(theta: Any):
    one, two = theta.dtype(1.0), theta.dtype(2.0)
    mu = theta[0] / (two * (one + theta[1]))
    lam = theta[0] * theta[1] / ((one + theta[1]) * (one - two * theta[1]))
    return mu, lam


@wp.func
def stress(F: Any, D: Any, theta: Any):
    mu, lam = moduli(theta)
    J = wp.determinant(F)
    shear = (F.dtype(2.0) * mu / J) * (F - rotation(F)) * wp.transpose(F)
    return shear + lam * (J - F.dtype(1.0)) * wp.identity(n=3, dtype=F.dtype)


def lame(E: float, nu: float) -> tuple[float, float]:
    """Shear modulus mu and first Lame parameter lambda [Pa]."""
    return E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))


def twin(F, D, E, nu):
    mu, lam = lame(E, nu)
    U, _, Vt = np.linalg.svd(F)
    R = U @ Vt
    J = np.linalg.det(F)[..., None, None]
    return 2 * mu / J * (F - R) @ np.swapaxes(F, -1, -2) + lam * (J - 1) * np.eye(3)


def energy(F, E, nu):
    mu, lam = lame(E, nu)
    stretch = np.linalg.svd(F, compute_uv=False)
    return mu * ((stretch - 1) ** 2).sum(-1) + lam / 2 * (np.linalg.det(F) - 1) ** 2


def wave_modulus(E, nu):
    mu, lam = lame(E, nu)
    return lam + 2 * mu


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
