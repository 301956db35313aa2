"""Stiff strands along one direction that resist stretch only.

    psi = k1 / (2 k2) (exp(k2 <I4 - 1>^2) - 1),  P = 2 k1 <I4 - 1> exp(k2 <I4 - 1>^2) F a (x) a     [Pa]

Holzapfel, Gasser and Ogden, A new constitutive framework for arterial wall mechanics, J. Elasticity 61 (2000).
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from surgisim.phantom.effect import Effect, Hidden, along_tissue
from surgisim.phantom.forces import FAST
from surgisim.phantom.strains import Patch, gradient, scatter


@dataclass(frozen=True)
class Strands:
    patch: Patch
    k1: float
    k2: float
    a: np.ndarray

    def add(self, x, v, t, dt, force):
        _add(x, *self.patch.args, self.k1, self.k2, self.a, force)


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _add(x, cells, slope, volume, k1, k2, a, force):
    F, P, turned = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for m in range(len(cells)):
        gradient(x, cells, slope, m, F)
        long = 0.0
        for i in range(3):
            turned[i] = F[i, 0] * a[0] + F[i, 1] * a[1] + F[i, 2] * a[2]
            long += turned[i] * turned[i]
        if long <= 1.0:
            continue
        pull = 2 * k1 * (long - 1) * np.exp(k2 * (long - 1) ** 2)
        for i in range(3):
            for k in range(3):
                P[i, k] = pull * turned[i] * a[k]
        scatter(P, cells, slope, volume, m, force)


def draw(scene, rng, name):
    k2 = rng.uniform(0.05, 0.4)
    return Hidden(name, numbers={"k2": (k2, "1"), "direction": (along_tissue(scene, rng), "1")})


def apply(model, hidden):
    k1 = hidden.magnitude * model.scene.law.E
    law = Strands(model.patch(), k1, hidden.number("k2"), hidden.vector("direction"))
    return model.with_force(law, mu=6 * k1)


EFFECT = Effect(
    draw=draw,
    apply=apply,
    parameter="k1",
    unit="Pa",
    start=0.3,
    most=4.0,
    value=lambda scene, hidden: hidden.magnitude * scene.law.E,
)
