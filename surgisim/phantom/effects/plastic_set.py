"""Tissue that yields in shear beyond a strain and keeps its new shape.

    P += mu F (Cp^-1 - 1),  b = J^(-2/3) F Cp^-1 F^T,  |dev b| <= sqrt(2) (2 y)                     [Pa]

Radial return of Simo, A framework for finite strain elastoplasticity, CMAME 66 (1988); y is half the shear angle
at which a sheared cube yields, to first order.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from surgisim.phantom.effect import Effect, Hidden
from surgisim.phantom.forces import FAST
from surgisim.phantom.strains import Patch, cofactor, gradient, scatter


@dataclass(frozen=True)
class Yield:
    patch: Patch
    mu: float
    least: float
    """Norm of dev b at which it yields."""
    shape: np.ndarray
    """Cp^-1, (M, 3, 3)."""

    def add(self, x, v, t, dt, force):
        _add(x, *self.patch.args, self.mu, self.least, self.shape, force)


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _add(x, cells, slope, volume, mu, least, shape, force):
    F, C, P = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    half, b = np.empty((3, 3)), np.empty((3, 3))
    for m in range(len(cells)):
        gradient(x, cells, slope, m, F)
        J = cofactor(F, C)
        shrink = J ** (-2.0 / 3.0)
        for i in range(3):
            for k in range(3):
                half[i, k] = F[i, 0] * shape[m, 0, k] + F[i, 1] * shape[m, 1, k] + F[i, 2] * shape[m, 2, k]
        for i in range(3):
            for k in range(3):
                b[i, k] = shrink * (half[i, 0] * F[k, 0] + half[i, 1] * F[k, 1] + half[i, 2] * F[k, 2])
        mean = (b[0, 0] + b[1, 1] + b[2, 2]) / 3
        size = 0.0
        for i in range(3):
            b[i, i] -= mean
            for k in range(3):
                size += b[i, k] * b[i, k]
        size = np.sqrt(size)
        if size > least:
            back = least / size
            for i in range(3):
                for k in range(3):
                    b[i, k] *= back
                b[i, i] += mean
            # Volume is not a matter of shape: det b = 1 again.
            volume_b = (
                b[0, 0] * (b[1, 1] * b[2, 2] - b[1, 2] * b[2, 1])
                - b[0, 1] * (b[1, 0] * b[2, 2] - b[1, 2] * b[2, 0])
                + b[0, 2] * (b[1, 0] * b[2, 1] - b[1, 1] * b[2, 0])
            )
            b *= volume_b ** (-1.0 / 3.0)
            # Cp^-1 = J^(2/3) F^-1 b F^-T, with F^-T = C / J
            for i in range(3):
                for k in range(3):
                    half[i, k] = b[i, 0] * C[0, k] + b[i, 1] * C[1, k] + b[i, 2] * C[2, k]
            for i in range(3):
                for k in range(3):
                    total = C[0, i] * half[0, k] + C[1, i] * half[1, k] + C[2, i] * half[2, k]
                    shape[m, i, k] = total / (shrink * J * J)
        for i in range(3):
            for k in range(3):
                total = 0.0
                for j in range(3):
                    total += F[i, j] * (shape[m, j, k] - (1.0 if j == k else 0.0))
                P[i, k] = mu * total
        scatter(P, cells, slope, volume, m, force)


def draw(scene, rng, name):
    return Hidden(name)


def apply(model, hidden):
    patch = model.patch()
    memory = np.tile(np.eye(3), (len(patch.cells), 1, 1))
    least = np.sqrt(2.0) / hidden.magnitude
    return model.with_force(Yield(patch, model.scene.law.mu, least, memory))


EFFECT = Effect(
    draw=draw,
    apply=apply,
    parameter="yield_strain",
    unit="1",
    start=2.0,
    most=40.0,
    value=lambda scene, hidden: 1 / (2 * hidden.magnitude),
)
