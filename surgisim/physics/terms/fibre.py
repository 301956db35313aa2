"""Fibres: tissue that resists being stretched along one direction, and ever more so.

    psi = k1 / (2 k2) (exp(k2 r^2) - 1),   r = <I4 - 1>,   I4 = |F a|^2      [J/m^3]
    sigma = 2 k1 r r' exp(k2 r^2) Fa (x) Fa / J                              [Pa]

a is the fibres' direction at rest (by yaw and pitch, see physics/heading.py; to the right in the image by default),
k1 [Pa] a quarter of the modulus they add along it, k2 how fast they stiffen. They bear no compression. <x> = x^3 /
(x^2 + .01^2) for x > 0: the half per cent of crimp takes away the kink that a plain <x> has exactly at rest, so the
slope of the stress there is zero, and the same from both sides.
Holzapfel, Gasser and Ogden, A new constitutive framework for arterial wall mechanics, J. Elasticity 61 (2000).
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.heading import heading
from surgisim.physics.strain import WORKING_STRETCH, twin_ramp

CRIMP = 0.01
"""Stretch, as I4 - 1, over which fibres straighten."""


@wp.func
def stress(F: Any, D: Any, theta: Any):
    Fa = F * wp.vector(theta[2], theta[3], theta[4], dtype=F.dtype)
    x = wp.max(wp.dot(Fa, Fa) - F.dtype(1.0), F.dtype(0.0))
    crimp = F.dtype(CRIMP) * F.dtype(CRIMP)
    bottom = x * x + crimp
    r = x * x * x / bottom
    slope = x * x * (x * x + F.dtype(3.0) * crimp) / (bottom * bottom)
    pull = F.dtype(2.0) * theta[0] * r * slope * wp.exp(theta[1] * r * r)
    return (pull / wp.determinant(F)) * wp.outer(Fa, Fa)


def twin(F, D, k1, k2, x, y, z):
    Fa = F @ np.array([x, y, z])
    over = np.maximum((Fa**2).sum(-1) - 1, 0)
    r = twin_ramp(over, CRIMP)
    slope = over**2 * (over**2 + 3 * CRIMP**2) / (over**2 + CRIMP**2) ** 2
    pull = 2 * k1 * r * slope * np.exp(k2 * r**2) / np.linalg.det(F)
    return pull[..., None, None] * Fa[..., :, None] * Fa[..., None, :]


def energy(F, k1, k2, x, y, z):
    r = twin_ramp(((F @ np.array([x, y, z])) ** 2).sum(-1) - 1, CRIMP)
    return k1 / 2 * r**2 if k2 == 0 else k1 / (2 * k2) * np.expm1(k2 * r**2)


def wave_modulus(k1, k2, **axis):
    """d2(psi)/d(stretch)2 along the fibres at the working stretch, for the modulus at rest is the smallest there is."""
    x = WORKING_STRETCH**2 - 1
    return 2 * k1 * np.exp(k2 * x**2) * (x + 2 * WORKING_STRETCH**2 * (1 + 2 * k2 * x**2))


def columns(k1, k2, yaw, pitch):
    x, y, z = heading(yaw, pitch)
    return {"k1": k1, "k2": k2, "x": x, "y": y, "z": z}


TERM = Term(
    stress=stress,
    twin=twin,
    energy=energy,
    wave_modulus=wave_modulus,
    columns=columns,
    params={
        "k1": Param("Pa", low=1e1, high=1e5, default=5e2, off=0.0),
        "k2": Param("1", low=0.0, high=5.0, default=0.5, logarithmic=False),
        "yaw": Param("rad", low=-np.pi, high=np.pi, default=np.pi / 2, logarithmic=False),
        "pitch": Param("rad", low=-np.pi, high=np.pi, default=0.0, logarithmic=False),
    },
)
