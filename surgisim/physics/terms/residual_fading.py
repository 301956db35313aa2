"""Residual fading: a resistance that fades while tissue is held, to shear and to changes of volume apart.

    S = shear (A - q) + bulk (b - p) C^-1,   sigma = F S F^T / J       [Pa]
    A = 1 - C^-1,  b = (J^2 - 1) / 2,   dq/dt = (A - q) / tau,  dp/dt = (b - p) / tau

C = F^T F. A and b are what `neo_hookean_ciarlet` measures strain by, q and p their parts that have faded already, in
the tissue's own frame; at once it resists as that law does with moduli `shear` and `bulk` [Pa], in the end not at all.
Unlike `relaxation` it may fade in volume. No cause is claimed: fluid that leaves, strands that slip, or both.
Quasi-linear viscoelasticity with one exponential: Fung, Biomechanics: mechanical properties of living tissues, 2nd ed.
(1993), section 7.6.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term


@wp.func
def stress(F: Any, D: Any, R: Any, q: Any, theta: Any, t: Any):
    one = wp.identity(n=3, dtype=F.dtype)
    J = wp.determinant(F)
    left = wp.inverse(wp.transpose(F) * F)
    faded = wp.matrix(q[0], q[3], q[4], q[3], q[1], q[5], q[4], q[5], q[2], shape=(3, 3), dtype=F.dtype)
    b = F.dtype(0.5) * (J * J - F.dtype(1.0))
    S = theta[0] * (one - left - faded) + (theta[1] * (b - q[6])) * left
    return F * S * wp.transpose(F) / J


@wp.func
def advance(F: Any, D: Any, R: Any, u: Any, q: Any, theta: Any, dt: Any):
    A = wp.identity(n=3, dtype=F.dtype) - wp.inverse(wp.transpose(F) * F)
    J = wp.determinant(F)
    b = F.dtype(0.5) * (J * J - F.dtype(1.0))
    now = wp.vector(A[0, 0], A[1, 1], A[2, 2], A[0, 1], A[0, 2], A[1, 2], b, dtype=F.dtype)
    # 1 - exp(-x) through tanh, which keeps the digits of a small x.
    half = wp.tanh(F.dtype(0.5) * dt / theta[2])
    return q + (F.dtype(2.0) * half / (F.dtype(1.0) + half)) * (now - q)


def measured(F):
    """A, (..., 3, 3), and b, (...)."""
    C = np.swapaxes(F, -1, -2) @ F
    return np.eye(3) - np.linalg.inv(C), 0.5 * (np.linalg.det(C) - 1)


def twin(F, D, q, t, shear, bulk, tau):
    A, b = measured(F)
    q = np.asarray(q)
    xx, yy, zz, xy, xz, yz, p = np.moveaxis(q, -1, 0)
    faded = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], -1).reshape(*xx.shape, 3, 3)
    S = shear * (A - faded) + bulk * (b - p)[..., None, None] * (np.eye(3) - A)
    return F @ S @ np.swapaxes(F, -1, -2) / np.linalg.det(F)[..., None, None]


def twin_advance(F, D, u, q, dt, shear, bulk, tau):
    A, b = measured(F)
    now = np.concatenate([A[..., [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]], np.asarray(b)[..., None]], -1)
    return now + (q - now) * np.exp(-dt / tau)


TERM = Term(
    stress=stress,
    advance=advance,
    memory=7,
    twin=twin,
    twin_advance=twin_advance,
    wave_modulus=lambda shear, bulk, tau: 2 * shear + bulk,
    params={
        "shear": Param("Pa", low=1e1, high=1e5, default=2e2, off=0.0),
        "bulk": Param("Pa", low=1e1, high=1e5, default=4e2, off=0.0),
        "tau": Param("s", low=2e-2, high=2e1, default=0.5),
    },
)
