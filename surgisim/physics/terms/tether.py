"""An adhesion: slack bands from tissue to fixed points behind it, which hold once they are taut.

    r = u - l d,   f = -k g(|r| - l - slack) r / |r|                  [N/m^3]
    g(x) = 0 for x < 0,   x^2 / (2 w) for x < w,   x - w/2 beyond     [m],  w = 0.2 mm

u displacement [m]; at rest every band is l [m] long and leads along d (by yaw and pitch, see
physics/heading.py; straight away from the camera by default); k [N/m^4] is the stiffness of all bands
together [N/m] shared out over the law's place. Moving toward the far end never tightens a band. A long
band resists only motion away from d, a short one motion to all sides.
One-sided springs with a slack: Fung, Biomechanics: mechanical properties of living tissues, 2nd ed. (1993),
chapter 7, for the slack ("toe") region of collagenous tissue. The parabola g is our own choice of a smooth start.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.heading import PITCH, YAW, heading

WIDTH = 2e-4
"""Stretch over which a band becomes taut [m]."""


@wp.func
def force(u: Any, v: Any, q: Any, rho: Any, theta: Any, t: Any):
    band = u - theta[2] * wp.vector(theta[3], theta[4], theta[5], dtype=theta.dtype)
    length = wp.length(band)
    beyond = length - theta[2] - theta[1]
    width = theta.dtype(WIDTH)
    if beyond <= theta.dtype(0.0):
        return u - u
    taut = beyond - theta.dtype(0.5) * width
    if beyond < width:
        taut = beyond * beyond / (theta.dtype(2.0) * width)
    return (-theta[0] * taut / length) * band


def twin(u, v, q, rho, t, stiffness, slack, length, x, y, z):
    band = u - length * np.array([x, y, z])
    reach = np.linalg.norm(band, axis=-1, keepdims=True)
    beyond = np.maximum(reach - length - slack, 0)
    taut = np.where(beyond < WIDTH, beyond**2 / (2 * WIDTH), beyond - WIDTH / 2)
    return -stiffness * taut * band / reach


def columns(stiffness, slack, length, yaw, pitch):
    x, y, z = heading(yaw, pitch)
    return {"stiffness": stiffness, "slack": slack, "length": length, "x": x, "y": y, "z": z}


TERM = Term(
    force=force,
    twin=twin,
    columns=columns,
    spring=lambda stiffness, **_: stiffness,
    place="somewhere",
    params={
        "stiffness": Param("N/m", low=0.1, high=1e3, default=20.0, off=0.0, total=True),
        "slack": Param("m", low=0.0, high=0.02, default=0.001, logarithmic=False),
        "length": Param("m", low=0.001, high=0.1, default=0.01),
        "yaw": Param("rad", *YAW, default=0.0, logarithmic=False),
        "pitch": Param("rad", *PITCH, default=0.0, logarithmic=False),
    },
)
