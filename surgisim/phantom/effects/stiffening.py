"""Tissue that grows stiffer the more it is strained.

    psi = alpha mu / 4 (I1' - 3)^2,  I1' = J^(-2/3) tr F^T F                                        [J/m^3]

The second term of Yeoh, Some forms of the strain energy function for rubber, Rubber Chem. Technol. 66 (1993): the
shear modulus becomes mu (1 + alpha (I1' - 3)).
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from surgisim.phantom.effect import Effect, Hidden
from surgisim.phantom.forces import FAST
from surgisim.phantom.strains import Patch, cofactor, gradient, scatter, square


@dataclass(frozen=True)
class Second:
    patch: Patch
    modulus: float

    def add(self, x, v, t, dt, force):
        _add(x, *self.patch.args, self.modulus, force)


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _add(x, cells, slope, volume, modulus, force):
    F, C, P = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for m in range(len(cells)):
        gradient(x, cells, slope, m, F)
        J = cofactor(F, C)
        whole = square(F)
        shrink = J ** (-2.0 / 3.0)
        slope_psi = modulus * (shrink * whole - 3) * shrink
        for i in range(3):
            for k in range(3):
                P[i, k] = slope_psi * (F[i, k] - whole / (3 * J) * C[i, k])
        scatter(P, cells, slope, volume, m, force)


def draw(scene, rng, name):
    return Hidden(name)


def apply(model, hidden):
    mu = model.scene.law.mu
    return model.with_force(Second(model.patch(), hidden.magnitude * mu), mu=2 * hidden.magnitude * mu)


EFFECT = Effect(draw=draw, apply=apply, parameter="alpha", unit="1", start=1.0, most=12.0)
