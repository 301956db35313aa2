"""Residual stiffness: tissue that resists a load otherwise than its base law, from a moment on or from a strain on.

    psi = k(t) (shear / 2 (tr C - 3 - 2 ln J) + bulk / 4 (J^2 - 1 - 2 ln J)) + strained / 2 (sqrt(s^2 + w^2) - w)
    s = J^(-2/3) tr C - 3,   k(t) = (1 + tanh(STEEP (t - onset - rise / 2) / rise)) / 2          [J/m^3]
    sigma = k/J (shear (F F^T - 1) + bulk/2 (J^2 - 1) 1) + strained/J (s / sqrt(s^2 + w^2)) dev(J^(-2/3) F F^T)

C = F^T F. `shear` and `bulk` [Pa] are added to the base's Lame numbers, of either sign, where the law acts: softer
tissue has negative ones. `strained` [Pa] is added to the shear modulus little by little once s, the squared strain,
nears w [1]. It does nothing where nothing is strained, and conserves energy once k has come. No cause is claimed: a
lump, a cut, a layer or a softening with strain may be behind it.
The form is `neo_hookean_ciarlet`'s; Ciarlet, Mathematical Elasticity I (1988), section 4.10; the last part is ours.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.course import PARAMS, STEEP
from surgisim.physics.strain import deviator, twin_deviator


@wp.func
def stress(F: Any, D: Any, R: Any, q: Any, theta: Any, t: Any):
    one, half = F.dtype(1.0), F.dtype(0.5)
    eye = wp.identity(n=3, dtype=F.dtype)
    J = wp.determinant(F)
    here = half * (one + wp.tanh(F.dtype(STEEP) * (t - theta[4] - half * theta[5]) / theta[5]))
    B = F * wp.transpose(F)
    own = here * (theta[0] * (B - eye) + (half * theta[1] * (J * J - one)) * eye)
    Bbar = wp.pow(J, F.dtype(-2.0) / F.dtype(3.0)) * B
    s = wp.trace(Bbar) - F.dtype(3.0)
    return (own + (theta[2] * s / wp.sqrt(s * s + theta[3] * theta[3])) * deviator(Bbar)) / J


def here_at(t, onset, rise):
    """k(t)."""
    return 0.5 * (1 + np.tanh(STEEP * (t - onset - 0.5 * rise) / rise))


def twin(F, D, q, t, shear, bulk, strained, width, onset, rise):
    J = np.linalg.det(F)[..., None, None]
    B = F @ np.swapaxes(F, -1, -2)
    own = here_at(t, onset, rise) * (shear * (B - np.eye(3)) + bulk / 2 * (J**2 - 1) * np.eye(3))
    Bbar = J ** (-2 / 3) * B
    s = np.trace(Bbar, axis1=-2, axis2=-1)[..., None, None] - 3
    return (own + strained * s / np.sqrt(s**2 + width**2) * twin_deviator(Bbar)) / J


def modulus(off: float) -> Param:
    return Param("Pa", low=-1e5, high=1e5, default=0.0, off=off, logarithmic=False)


TERM = Term(
    stress=stress,
    twin=twin,
    wave_modulus=lambda shear, bulk, strained, **_: 2 * max(shear, 0.0) + max(bulk, 0.0) + 2 * max(strained, 0.0),
    params={
        "shear": modulus(0.0),
        "bulk": modulus(0.0),
        "strained": modulus(0.0),
        "width": Param("1", low=0.01, high=1.0, default=0.1),
        "onset": Param("s", low=-1e2, high=6e1, default=-1e2, logarithmic=False),
        "rise": PARAMS["rise"],
    },
    example={"shear": 300.0, "bulk": 500.0, "strained": -200.0, "onset": 0.7, "rise": 0.6},
)
