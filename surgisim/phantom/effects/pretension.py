"""Tissue under tension before it is touched, in balance with what surrounds it.

    P += F S0,  S0 = s (a (x) a + r b (x) b),  nodal forces at rest taken away          [Pa]

Hoger, On the residual stress possible in an elastic body, ARMA 88 (1985): to first order a residual stress adds
a geometric stiffness.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from surgisim.phantom.effect import Effect, Hidden, along_tissue
from surgisim.phantom.forces import FAST
from surgisim.phantom.strains import Patch, gradient, scatter


@dataclass(frozen=True)
class Tension:
    patch: Patch
    stress: np.ndarray
    """S0 [Pa], (3, 3)."""
    balance: np.ndarray
    """What the surroundings pull with [N], (N, 3)."""

    def add(self, x, v, t, dt, force):
        _add(x, *self.patch.args, self.stress, force)
        force -= self.balance


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _add(x, cells, slope, volume, stress, force):
    F, P = np.empty((3, 3)), np.empty((3, 3))
    for m in range(len(cells)):
        gradient(x, cells, slope, m, F)
        for i in range(3):
            for k in range(3):
                P[i, k] = F[i, 0] * stress[0, k] + F[i, 1] * stress[1, k] + F[i, 2] * stress[2, k]
        scatter(P, cells, slope, volume, m, force)


def draw(scene, rng, name):
    numbers = {"direction": (along_tissue(scene, rng), "1"), "across": (rng.uniform(0.0, 1.0), "1")}
    return Hidden(name, numbers=numbers)


def apply(model, hidden):
    a = hidden.vector("direction")
    b = np.cross(model.scene.shape.axes[2], a)
    size = hidden.magnitude * model.scene.law.E
    stress = size * (np.outer(a, a) + hidden.number("across") * np.outer(b, b))
    patch, balance = model.patch(), np.zeros_like(model.mesh.points)
    _add(model.mesh.points, *patch.args, stress, balance)
    return model.with_force(Tension(patch, stress, balance), mu=size)


EFFECT = Effect(
    draw=draw,
    apply=apply,
    parameter="tension",
    unit="Pa",
    start=0.4,
    most=3.0,
    value=lambda scene, hidden: hidden.magnitude * scene.law.E,
)
