"""Residual stress: tissue that strains by itself where it is not loaded, in a course that time alone decides.

    S = T w(X) c(t),   sigma = F S F^T / J                             [Pa]

T [Pa] is symmetric, a second Piola stress, and turns with the tissue; w is the share of the law's place (a blob, a
layer, or 1 everywhere), c(t) physics/course.py's. It is the stress that holds back an eigenstrain e, T = -C : e with C
the tissue's stiffness: -T with equal components along all axes is a lump that swells, a single component a thread that
shortens. It has no net force and no net moment. No cause is claimed: it stands for a source of strain that no named
law has. While time stands still psi = T : (F^T F - 1) / 2 is its energy [J/m^3].
Mura, Micromechanics of Defects in Solids, 2nd ed. (1987), section 1: the eigenstrain; place and course are ours.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.course import EXAMPLE, PARAMS, at, course

AXES = ("xx", "yy", "zz", "xy", "xz", "yz")
"""Components, in their order."""


@wp.func
def stress(F: Any, D: Any, R: Any, q: Any, theta: Any, t: Any):
    T = wp.matrix(
        theta[0], theta[3], theta[4], theta[3], theta[1], theta[5], theta[4], theta[5], theta[2],
        shape=(3, 3), dtype=F.dtype,
    )  # fmt: skip
    return (course(theta, 6, t) / wp.determinant(F)) * (F * T * wp.transpose(F))


def tensor(xx, yy, zz, xy, xz, yz):
    """T, (3, 3)."""
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def twin(F, D, q, t, xx, yy, zz, xy, xz, yz, **times):
    T = tensor(xx, yy, zz, xy, xz, yz)
    return at(t, **times) * (F @ T @ np.swapaxes(F, -1, -2)) / np.linalg.det(F)[..., None, None]


def component() -> Param:
    return Param("Pa", low=-1e4, high=1e4, default=0.0, off=0.0, logarithmic=False)


TERM = Term(
    stress=stress,
    twin=twin,
    wave_modulus=lambda xx, yy, zz, xy, xz, yz, **times: float(np.linalg.norm(tensor(xx, yy, zz, xy, xz, yz))),
    params={**{axis: component() for axis in AXES}, **PARAMS},
    example={"xx": 60.0, "yy": -40.0, "zz": 90.0, "xy": 20.0, "xz": -30.0, "yz": 10.0, **EXAMPLE},
)
