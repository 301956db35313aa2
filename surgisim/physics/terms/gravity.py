"""Weight: tissue that was not in balance with gravity in the first frame sags from there.

    f = rho g S((t - t0) / e)                                         [N/m^3]
    S(x) = (1 + tanh x) / 2,   e = 0.02 s

rho density [kg/m^3], with what other laws add to it; g in the camera frame [m/s^2] (y points down in the image); t0 its
onset [s], by default before the first frame.
What a camera first sees usually hangs in balance already; then this law describes what changes after the
first frame (a tilted table, a lifted flap), and its size is that of the change, not 9.81.
Newton's second law; the smooth edge S is our own choice.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term

EDGE = 0.02
"""How fast it comes [s]."""


@wp.func
def force(u: Any, v: Any, q: Any, rho: Any, theta: Any, t: Any):
    risen = theta.dtype(0.5) * (theta.dtype(1.0) + wp.tanh((t - theta[3]) / theta.dtype(EDGE)))
    return (rho * risen) * wp.vector(theta[0], theta[1], theta[2], dtype=theta.dtype)


def twin(u, v, q, rho, t, x, y, z, onset):
    risen = 0.5 * (1 + np.tanh((t - onset) / EDGE))
    return risen * np.asarray(rho)[..., None] * np.array([x, y, z]) + 0 * u


def component(default: float) -> Param:
    return Param("m/s^2", low=-15.0, high=15.0, default=default, off=0.0, logarithmic=False)


TERM = Term(
    force=force,
    twin=twin,
    place="everywhere",
    rests=False,
    params={
        "x": component(0.0),
        "y": component(9.81),
        "z": component(0.0),
        "onset": Param("s", low=-1.0, high=60.0, default=-1.0, logarithmic=False),
    },
)
