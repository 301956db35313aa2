"""Pretension: tissue that is taut in what the camera first sees.

    psi = sum over d = a, b of T_d (|F d|^(1 + g) - 1) / (1 + g)            [J/m^3]
    P = sum of T_d |F d|^(g - 1) F d (x) d,   less what it is at rest       [Pa]

Along a the tissue is under a tension `along`, along b under `across` [Pa]; both turn with the tissue. a points along
yaw and pitch (physics/heading.py), b lies at right angles, turned about a by `roll` from a's right. The surroundings
hold the first frame in equilibrium: the stress at rest is taken off again as a dead load. What is left resists
bending and lifting, as a string's tension does. How tension changes with stretch is a matter of what made it: with
g = 1 the second Piola stress is constant (Hoger, On the residual stress possible in an elastic body, ARMA 88, 1985),
with g = 0 the force of a thread is, with g = -1 the Kirchhoff stress, which only turns. Smooth everywhere, and linear
in both tensions.
Biot, Mechanics of Incremental Deformations (1965), chapter 2.
"""

import math
from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.heading import PITCH, YAW, across_of, heading


@wp.func
def stress(F: Any, D: Any, theta: Any):
    one = F.dtype(1.0)
    Fa = F * wp.vector(theta[3], theta[4], theta[5], dtype=F.dtype)
    Fb = F * wp.vector(theta[6], theta[7], theta[8], dtype=F.dtype)
    first = theta[0] * wp.pow(wp.length(Fa), theta[2] - one)
    second = theta[1] * wp.pow(wp.length(Fb), theta[2] - one)
    return (first * wp.outer(Fa, Fa) + second * wp.outer(Fb, Fb)) / wp.determinant(F)


def _threads(F, ax, ay, az, bx, by, bz):
    return F @ np.array([ax, ay, az]), F @ np.array([bx, by, bz])


def twin(F, D, along, across, grows, **axes):
    total = 0.0
    for tension, Fd in zip((along, across), _threads(F, **axes), strict=True):
        length = np.linalg.norm(Fd, axis=-1)[..., None, None]
        total = total + tension * length ** (grows - 1) * Fd[..., :, None] * Fd[..., None, :]
    return total / np.linalg.det(F)[..., None, None]


def energy(F, along, across, grows, **axes):
    total, power = 0.0, 1 + grows
    for tension, Fd in zip((along, across), _threads(F, **axes), strict=True):
        stretch = np.log(np.linalg.norm(Fd, axis=-1))
        total = total + tension * (np.expm1(power * stretch) / power if power else stretch)
    return total


def columns(along, across, grows, yaw, pitch, roll):
    a, (right, down) = heading(yaw, pitch), across_of(yaw, pitch)
    b = math.cos(roll) * right + math.sin(roll) * down
    return {
        "along": along, "across": across, "grows": grows, "ax": a[0], "ay": a[1], "az": a[2],
        "bx": b[0], "by": b[1], "bz": b[2],
    }  # fmt: skip


TERM = Term(
    stress=stress,
    twin=twin,
    energy=energy,
    wave_modulus=lambda along, across, **axes: along + across,
    columns=columns,
    rests=False,
    balanced=True,
    params={
        "along": Param("Pa", low=1e0, high=1e4, default=1e2, off=0.0),
        "across": Param("Pa", low=1e0, high=1e4, default=1e2, off=0.0),
        "grows": Param("1", low=-1.0, high=1.0, default=1.0, logarithmic=False),
        "yaw": Param("rad", low=YAW[0], high=YAW[1], default=0.0, logarithmic=False),
        "pitch": Param("rad", low=PITCH[0], high=PITCH[1], default=0.0, logarithmic=False),
        "roll": Param("rad", low=-np.pi, high=np.pi, default=0.0, logarithmic=False),
    },
)
