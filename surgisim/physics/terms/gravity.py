"""Weight: tissue that was not in balance with gravity in the first frame sags from there.

    f = rho g                                                         [N/m^3]

rho density [kg/m^3], with what other laws add to it; g in the camera frame [m/s^2] (y points down in the image).
What a camera first sees usually hangs in balance already; then this law describes what changes after the
first frame (a tilted table, a lifted flap), and its size is that of the change, not 9.81.
Newton's second law.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term


@wp.func
def force(u: Any, v: Any, q: Any, rho: Any, theta: Any, t: Any):
    return rho * wp.vector(theta[0], theta[1], theta[2], dtype=theta.dtype)


def twin(u, v, q, rho, t, x, y, z):
    return np.asarray(rho)[..., None] * np.array([x, y, z]) + 0 * u


def component(default: float) -> Param:
    return Param("m/s^2", low=-15.0, high=15.0, default=default, off=0.0, logarithmic=False)


TERM = Term(
    force=force,
    twin=twin,
    place="everywhere",
    rests=False,
    params={"x": component(0.0), "y": component(9.81), "z": component(0.0)},
)
