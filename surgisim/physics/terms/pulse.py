"""A vessel that beats in the tissue: pressure that comes and goes.

    sigma = -p (sin(2 pi f t + a) - sin a) I                          [Pa]

p pressure [Pa], fading out around the law's place; f beats a second [1/s], a phase [rad]. Zero in the first frame,
from which everything is counted.
Only the first harmonic of what Womersley, Method for the calculation of velocity, rate of flow and viscous drag in
arteries when the pressure gradient is known, J. Physiology 127 (1955), measures.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term


@wp.func
def stress(F: Any, D: Any, R: Any, q: Any, theta: Any, t: Any):
    turn = theta.dtype(6.283185307179586) * theta[1] * t
    swing = wp.sin(turn + theta[2]) - wp.sin(theta[2])
    return (-theta[0] * swing) * wp.identity(n=3, dtype=F.dtype)


def twin(F, D, q, t, pressure, rate, phase):
    swing = np.sin(2 * np.pi * rate * t + phase) - np.sin(phase)
    return -pressure * swing * np.eye(3) + 0 * F


TERM = Term(
    stress=stress,
    twin=twin,
    place="somewhere",
    params={
        "pressure": Param("Pa", low=1.0, high=1e4, default=100.0, off=0.0),
        "rate": Param("1/s", low=0.5, high=4.0, default=1.2),
        "phase": Param("rad", low=-np.pi, high=np.pi, default=0.0, logarithmic=False),
    },
)
