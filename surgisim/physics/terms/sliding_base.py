"""The base lets tissue glide along it: friction instead of a bond.

    T = I - n n^T,   K_base <- K_base - w T K_base T                  (what held it before)
    f = -w k (T u - s),   |f| <= w c                                  [N/m^3], on held tissue
    where k |T u - s| > c:   s <- s + (|T u - s| - c / k) (T u - s) / |T u - s|              [m]

w the share of the bond that is given up [1], n the base's normal by yaw and pitch (physics/heading.py), k and c
[N/m^4, N/m^3] the base's tangential stiffness [N/m] and the largest friction it bears [N], both of the
whole base, shared out over what it holds. s is how far tissue has slid: elastic predictor and return to
Coulomb's cap, with the normal load taken as constant. Friction is counted against the base at rest,
also where another law moves the base. At a place, a patch, c is least in its middle and grows without bound around
it: there the springs k take over the bond that was given up, and never slide.
Simo and Laursen, An augmented Lagrangian treatment of contact problems involving friction, Computers and
Structures 42 (1992), section 3.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.heading import PITCH, YAW, heading


@wp.func
def beyond(u: Any, q: Any, theta: Any):
    """T u - s."""
    n = wp.vector(theta[3], theta[4], theta[5], dtype=theta.dtype)
    return u - wp.dot(u, n) * n - q


@wp.func
def force(u: Any, v: Any, q: Any, rho: Any, theta: Any, t: Any):
    return (-theta[0] * theta[1]) * beyond(u, q, theta)


@wp.func
def advance(F: Any, D: Any, R: Any, u: Any, q: Any, theta: Any, dt: Any):
    stretch = beyond(u, q, theta)
    pull = theta[1] * wp.length(stretch)
    if pull > theta[2]:
        return q + (theta.dtype(1.0) - theta[2] / pull) * stretch
    return q


def twin(u, v, q, rho, t, share, stiffness, cap, x, y, z):
    return -share * stiffness * _beyond(u, q, x, y, z)


def twin_advance(F, D, u, q, dt, share, stiffness, cap, x, y, z):
    stretch = _beyond(u, q, x, y, z)
    pull = stiffness * np.linalg.norm(stretch, axis=-1, keepdims=True)
    return q + np.where(pull > cap, 1 - cap / np.where(pull > 0, pull, 1.0), 0.0) * stretch


def _beyond(u, q, x, y, z):
    n = np.array([x, y, z])
    return u - (u @ n)[..., None] * n - q


def columns(share, stiffness, cap, yaw, pitch):
    x, y, z = heading(yaw, pitch)
    return {"share": share, "stiffness": stiffness, "cap": cap, "x": x, "y": y, "z": z}


def drive(path, share, stiffness, cap, yaw, pitch):
    n = np.array(heading(yaw, pitch))
    T = np.eye(3) - np.outer(n, n)
    springs = path.stiffness.copy()
    springs[0] -= share * T @ springs[0] @ T
    return replace(path, stiffness=springs)


TERM = Term(
    force=force,
    advance=advance,
    memory=3,
    drive=drive,
    twin=twin,
    twin_advance=twin_advance,
    columns=columns,
    spring=lambda share, stiffness, **_: share * stiffness,
    on="held",
    params={
        "share": Param("1", low=0.0, high=1.0, default=0.9, off=0.0, logarithmic=False, outside="stays"),
        "stiffness": Param("N/m", low=10.0, high=1e5, default=1e3, total=True, outside="stays"),
        "cap": Param("N", low=1e-3, high=10.0, default=0.1, total=True, outside="grows"),
        "yaw": Param("rad", *YAW, default=0.0, logarithmic=False),
        "pitch": Param("rad", *PITCH, default=0.0, logarithmic=False),
    },
)
