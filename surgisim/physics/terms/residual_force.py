"""Residual force: something unknown pushes the tissue, in a course that time alone decides.

    f = F w(X) c(t),   w(X) = exp(-|X - X0|^2 / (2 r^2)) over its integral   [N/m^3]

F [N] is the whole of it, along x, y and z; X0 and r are the law's place, at rest; c(t) is physics/course.py's: it sets
in, and stays, fades, ends or comes again and again. No cause is claimed: it stands for a load that no named law has,
and is only as good as its prediction of frames that it was not fitted to. While time stands still it conserves energy.
The simplest source of a quasi-static misfit, as in traction force microscopy: Dembo and Wang, Stresses at the
cell-to-substrate interface during locomotion of fibroblasts, Biophys. J. 76 (1999); the place and the course are ours.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.course import EXAMPLE, PARAMS, at, course


@wp.func
def force(u: Any, v: Any, q: Any, rho: Any, theta: Any, t: Any):
    return course(theta, 3, t) * wp.vector(theta[0], theta[1], theta[2], dtype=theta.dtype)


def twin(u, v, q, rho, t, x, y, z, **times):
    return at(t, **times) * np.array([x, y, z]) + 0 * u


def component() -> Param:
    return Param("N", low=-10.0, high=10.0, default=0.0, off=0.0, logarithmic=False, total=True)


TERM = Term(
    force=force,
    twin=twin,
    place="somewhere",
    params={"x": component(), "y": component(), "z": component(), **PARAMS},
    example={"x": 0.05, "y": -0.08, "z": 0.1, **EXAMPLE},
)
