"""The viscous part as SurgiSim's paper writes it.

    dF_v/dt = F_v gamma D,   sigma = det(F_v) 2 eta D                 [Pa]

Since d(ln det F_v)/dt = gamma tr D = gamma d(ln J)/dt, the determinant is J^gamma, and no F_v
needs to be carried along. Stresses add (Kelvin-Voigt): nothing relaxes in a hold, and gamma acts
only through J^gamma, which is near 1 for nearly incompressible tissue.
Wang et al., Realistic surgical simulation from monocular videos (SurgiSim), section 3.3.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term


@wp.func
def stress(F: Any, D: Any, theta: Any):
    return (F.dtype(2.0) * theta[0] * wp.pow(wp.determinant(F), theta[1])) * D


def twin(F, D, eta, gamma):
    return 2 * eta * np.linalg.det(F)[..., None, None] ** gamma * D


TERM = Term(
    stress=stress,
    twin=twin,
    viscosity=lambda eta, gamma: eta,
    params={
        "eta": Param("Pa s", low=1e-2, high=1e3, default=2.0, off=0.0),
        "gamma": Param("1", low=0.0, high=2.0, default=1.0, logarithmic=False),
    },
)
