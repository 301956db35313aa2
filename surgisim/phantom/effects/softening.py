"""Tissue that grows softer the more it is strained, and recovers when let go: its stiffness falls with strain.

    psi = -D mu / 2 (s - w ln(1 + s / w)),  s = I1' - 3               [J/m^3]

The shear modulus becomes mu (1 - D s / (s + w)). Not in the catalogue: stiffening has the other sign, damage stays.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from surgisim.artifacts.character import Truly
from surgisim.phantom.effect import Effect, Hidden
from surgisim.phantom.forces import FAST
from surgisim.phantom.strains import Patch, cofactor, gradient, scatter, square


@dataclass(frozen=True)
class Softer:
    patch: Patch
    modulus: float
    width: float

    def add(self, x, v, t, dt, force):
        _add(x, *self.patch.args, self.modulus, self.width, force)


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _add(x, cells, slope, volume, modulus, width, force):
    F, C, P = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for m in range(len(cells)):
        gradient(x, cells, slope, m, F)
        J = cofactor(F, C)
        whole = square(F)
        shrink = J ** (-2.0 / 3.0)
        strain = max(shrink * whole - 3, 0.0)
        slope_psi = -modulus * shrink * strain / (strain + width)
        for i in range(3):
            for k in range(3):
                P[i, k] = slope_psi * (F[i, k] - whole / (3 * J) * C[i, k])
        scatter(P, cells, slope, volume, m, force)


def draw(scene, rng, name):
    return Hidden(name, numbers={"width": (rng.uniform(0.02, 0.1), "1")})


def apply(model, hidden):
    modulus = hidden.magnitude * model.scene.law.mu
    return model.with_force(Softer(model.patch(), modulus, hidden.number("width")))


# It conserves energy: what a load stores less than before, a release gives back less.
CHARACTER = Truly(at_rest=(False,), change=("holds",), energy=("neither",), local=(False,))
EFFECT = Effect(
    draw=draw, apply=apply, parameter="most", unit="1", start=0.6, most=0.95, outside=True, character=CHARACTER
)
