"""Fluid over the tissue slows its surface.

    f = -c rho v                                                      [N/m^3], on surface tissue

c [1/s] the rate at which a free piece of surface would lose its speed, rho density [kg/m^3], v velocity [m/s]. The
layer it acts on is one particle thick, so c goes with the inverse of the particles' distance.
Rayleigh, The theory of sound, vol. 1, 2nd ed. (1894), section 81: resistance in proportion to mass and velocity.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term


@wp.func
def force(u: Any, v: Any, q: Any, rho: Any, theta: Any, t: Any):
    return (-theta[0] * rho) * v


def twin(u, v, q, rho, t, c):
    return -c * np.asarray(rho)[..., None] * v


TERM = Term(
    force=force,
    twin=twin,
    damper=lambda c: c,
    place="everywhere",
    on="surface",
    params={"c": Param("1/s", low=0.01, high=1e3, default=5.0, off=0.0)},
)
