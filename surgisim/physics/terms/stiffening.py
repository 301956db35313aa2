"""Strain stiffening: tissue that resists more the further it is stretched already.

    psi = (k/4) (Ibar1 - 3)^2                                         [J/m^3]
    sigma = (k/J) (Ibar1 - 3) dev(Bbar)                               [Pa]

Bbar = J^(-2/3) F F^T, Ibar1 = tr Bbar >= 3, k [Pa]. Beside a base of shear modulus mu the modulus becomes
mu (1 + alpha (Ibar1 - 3)) with alpha = k / mu: the second term of Yeoh's series. Nothing to first order in strain;
smooth everywhere.
Yeoh, Some forms of the strain energy function for rubber, Rubber Chemistry and Technology 66 (1993).
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.strain import WORKING_STRETCH, deviator, twin_deviator


@wp.func
def stress(F: Any, D: Any, theta: Any):
    J = wp.determinant(F)
    B = wp.pow(J, F.dtype(-2.0) / F.dtype(3.0)) * (F * wp.transpose(F))
    return (theta[0] / J * (wp.trace(B) - F.dtype(3.0))) * deviator(B)


def twin(F, D, k):
    J = np.linalg.det(F)[..., None, None]
    B = J ** (-2 / 3) * F @ np.swapaxes(F, -1, -2)
    return k / J * (np.trace(B, axis1=-2, axis2=-1)[..., None, None] - 3) * twin_deviator(B)


def energy(F, k):
    return k / 4 * (np.linalg.det(F) ** (-2 / 3) * (F**2).sum((-1, -2)) - 3) ** 2


def wave_modulus(k):
    """d2(psi)/d(stretch)2 of a bar of constant volume at the working stretch; at rest it is zero."""
    s = WORKING_STRETCH
    growth, slope, bend = s**2 + 2 / s - 3, 2 * s - 2 / s**2, 2 + 4 / s**3
    return k / 2 * (slope**2 + growth * bend)


TERM = Term(
    stress=stress,
    twin=twin,
    energy=energy,
    wave_modulus=wave_modulus,
    params={"k": Param("Pa", low=1e1, high=1e5, default=1e3, off=0.0)},
)
