"""Relaxation: part of the resistance to shear fades while tissue is held, and creeps back after release.

    psi = G |dev U - q|^2,   dq/dt = (dev U - q) / tau                [J/m^3]
    sigma = (1/J) R (T + K) F^T,   T = 2 G (dev U - q)                [Pa]

A spring of shear modulus G behind a dashpot of relaxation time tau, beside the base: a standard linear solid. F = R
U; q is the strain that the dashpot has taken, in tissue's own frame, so it turns with the tissue. K is the skew
tensor with K U + U K = U T - T U: with it the stress is d(psi)/dF and symmetric though q and U need not be coaxial.
At rest in q the branch resists as 2 G dev does in fixed corotated elasticity, so G / mu is its share at every
strain. A step takes q' = dev U + (q - dev U) exp(-dt / tau), exact where the strain is held. Power lost is 2 G |dev
U - q|^2 / tau >= 0. Smooth in everything. G and tau, not G tau and tau: the memory does not depend on G, so the
misfit's slope at G = 0 already tells whether, where and with which tau a branch pays.
Zener, Elasticity and Anelasticity of Metals (1948), chapter 5; Simo and Hughes, Computational Inelasticity (1998),
ch. 10.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.strain import (
    deviator,
    of_eigenvalues,
    packed,
    twin_deviator,
    twin_packed,
    twin_unpacked,
    unpacked,
)


@wp.func
def stress(F: Any, D: Any, R: Any, q: Any, theta: Any, t: Any):
    U = wp.transpose(R) * F
    T = (F.dtype(2.0) * theta[0]) * (deviator(U) - unpacked(q))
    M = U * T - T * U
    k = wp.inverse(wp.trace(U) * wp.identity(n=3, dtype=F.dtype) - U) * wp.vector(
        M[2, 1], M[0, 2], M[1, 0], dtype=F.dtype
    )
    return R * (T + wp.skew(k)) * wp.transpose(F) / wp.determinant(F)


@wp.func
def advance(F: Any, D: Any, R: Any, u: Any, q: Any, theta: Any, dt: Any):
    e = packed(deviator(wp.transpose(R) * F))
    # 1 - exp(-x) through tanh, which keeps the digits of a small x.
    half = wp.tanh(F.dtype(0.5) * dt / theta[1])
    return q + (F.dtype(2.0) * half / (F.dtype(1.0) + half)) * (e - q)


def twin(F, D, q, t, G, tau):
    C = np.swapaxes(F, -1, -2) @ F
    values, axes = np.linalg.eigh(C)
    stretch = np.sqrt(values)
    U = (axes * stretch[..., None, :]) @ np.swapaxes(axes, -1, -2)
    T = 2 * G * (twin_deviator(U) - twin_unpacked(q))
    # d(psi)/dC where C = U^2: in the axes of U, dC_ij = (U_i + U_j) dU_ij.
    turned = np.swapaxes(axes, -1, -2) @ T @ axes
    S = axes @ (2 * turned / (stretch[..., :, None] + stretch[..., None, :])) @ np.swapaxes(axes, -1, -2)
    return F @ S @ np.swapaxes(F, -1, -2) / np.linalg.det(F)[..., None, None]


def twin_advance(F, D, u, q, dt, G, tau):
    e = twin_packed(twin_deviator(of_eigenvalues(np.swapaxes(F, -1, -2) @ F, np.sqrt)))
    return e + (q - e) * np.exp(-dt / tau)


TERM = Term(
    stress=stress,
    advance=advance,
    memory=5,
    twin=twin,
    twin_advance=twin_advance,
    wave_modulus=lambda G, tau: 4 / 3 * G,
    params={
        "G": Param("Pa", low=1e1, high=1e5, default=5e2, off=0.0),
        "tau": Param("s", low=2e-2, high=2e1, default=0.5),
    },
)
