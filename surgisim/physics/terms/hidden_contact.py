"""Something unseen pushes the tissue somewhere, for a while: a second instrument, an organ behind it.

    f = p S((t - t0) / e) S((t1 - t) / e) d                           [N/m^3]
    S(x) = (1 + tanh x) / 2,   e = 0.02 s

p [N/m^3] is the whole force [N] shared out over the law's place, d its direction by yaw and pitch
(physics/heading.py), t0 its onset and t1 its end [s]. It rises and falls within about one frame of a video.
A prescribed force, not a contact that follows the tissue; the smooth edge S is our own choice.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.heading import PITCH, YAW, heading

EDGE = 0.02
"""How fast it comes and goes [s]."""


@wp.func
def force(u: Any, v: Any, q: Any, rho: Any, theta: Any, t: Any):
    one = theta.dtype(1.0)
    edge = theta.dtype(EDGE)
    risen = one + wp.tanh((t - theta[4]) / edge)
    left = one + wp.tanh((theta[5] - t) / edge)
    share = theta.dtype(0.25) * risen * left
    return (theta[0] * share) * wp.vector(theta[1], theta[2], theta[3], dtype=theta.dtype)


def twin(u, v, q, rho, t, force, x, y, z, onset, end):
    share = 0.25 * (1 + np.tanh((t - onset) / EDGE)) * (1 + np.tanh((end - t) / EDGE))
    return force * share * np.array([x, y, z]) + 0 * u


def columns(force, yaw, pitch, onset, end):
    x, y, z = heading(yaw, pitch)
    return {"force": force, "x": x, "y": y, "z": z, "onset": onset, "end": end}


TERM = Term(
    force=force,
    twin=twin,
    columns=columns,
    place="somewhere",
    params={
        "force": Param("N", low=1e-3, high=10.0, default=0.1, off=0.0, total=True),
        "yaw": Param("rad", *YAW, default=0.0, logarithmic=False),
        "pitch": Param("rad", *PITCH, default=0.0, logarithmic=False),
        "onset": Param("s", low=0.0, high=60.0, default=0.2, logarithmic=False),
        "end": Param("s", low=0.0, high=60.0, default=1.0, logarithmic=False),
    },
)
