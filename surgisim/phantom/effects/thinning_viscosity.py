"""A drag inside the tissue that hardly depends on how fast it deforms, so that it lingers after release.

    sigma = 2 k (|D|^2 + d0^2)^((n - 1)/2) D,  n < 1                                               [Pa]

Not in the catalogue: a power-law fluid (Ostwald and de Waele) beside the solid, smoothed at d0.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from surgisim.phantom.effect import Effect, Hidden
from surgisim.phantom.forces import FAST
from surgisim.phantom.strains import Patch, cofactor, gradient, scatter

SMOOTH = 0.5
"""d0 [1/s]."""


@dataclass(frozen=True)
class Paste:
    patch: Patch
    k: float
    n: float

    def add(self, x, v, t, dt, force):
        _add(x, v, *self.patch.args, self.k, self.n, force)


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _add(x, v, cells, slope, volume, k, n, force):
    F, R, C = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    D, P = np.empty((3, 3)), np.empty((3, 3))
    for m in range(len(cells)):
        gradient(x, cells, slope, m, F)
        gradient(v, cells, slope, m, R)
        J = cofactor(F, C)
        size = SMOOTH * SMOOTH
        for i in range(3):
            for j in range(3):
                D[i, j] = 0.0
                for s in range(3):
                    D[i, j] += 0.5 / J * (R[i, s] * C[j, s] + R[j, s] * C[i, s])
                size += D[i, j] * D[i, j]
        eta = 2 * k * size ** ((n - 1) / 2)
        for i in range(3):
            for j in range(3):
                P[i, j] = eta * (D[i, 0] * C[0, j] + D[i, 1] * C[1, j] + D[i, 2] * C[2, j])
        scatter(P, cells, slope, volume, m, force)


def draw(scene, rng, name):
    return Hidden(name, numbers={"n": (rng.uniform(0.15, 0.4), "1")})


def consistency(scene, hidden):
    """[Pa s^n]"""
    return hidden.magnitude * scene.law.E


def apply(model, hidden):
    k, n = consistency(model.scene, hidden), hidden.number("n")
    return model.with_force(Paste(model.patch(), k, n), eta=k * SMOOTH ** (n - 1))


EFFECT = Effect(
    draw=draw,
    apply=apply,
    parameter="k",
    unit="Pa s^n",
    start=3e-3,
    most=0.02,
    value=consistency,
    outside=True,
)
