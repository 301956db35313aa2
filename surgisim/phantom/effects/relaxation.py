"""A Maxwell branch beside the elastic one: stress that fades while the tissue is held.

    H' + H / tau = d/dt (g mu J^(-2/3) (1 - I1/3 C^-1)),  P = F (H - (H : C) / 3 C^-1)              [Pa]

Simo, On a fully three-dimensional finite-strain viscoelastic damage model, CMAME 60 (1987).
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from surgisim.phantom.effect import Effect, Hidden
from surgisim.phantom.forces import FAST
from surgisim.phantom.strains import Patch, cofactor, gradient, scatter, square


@dataclass(frozen=True)
class Branch:
    patch: Patch
    modulus: float
    tau: float
    fading: np.ndarray
    """H [Pa], (M, 3, 3)."""
    before: np.ndarray
    """What drives it, at the step before [Pa], (M, 3, 3)."""

    def add(self, x, v, t, dt, force):
        keep = math.exp(-dt / self.tau)
        _add(x, *self.patch.args, self.modulus, keep, math.sqrt(keep), self.fading, self.before, force)


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _add(x, cells, slope, volume, modulus, keep, half, fading, before, force):
    F, C, P = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    back, right = np.empty((3, 3)), np.empty((3, 3))
    for m in range(len(cells)):
        gradient(x, cells, slope, m, F)
        J = cofactor(F, C)
        whole = square(F)
        shrink = modulus * J ** (-2.0 / 3.0)
        spent = 0.0
        for i in range(3):
            for k in range(3):
                # C^-1 from the cofactors, and C itself.
                back[i, k] = (C[0, i] * C[0, k] + C[1, i] * C[1, k] + C[2, i] * C[2, k]) / (J * J)
                right[i, k] = F[0, i] * F[0, k] + F[1, i] * F[1, k] + F[2, i] * F[2, k]
                now = shrink * ((1.0 if i == k else 0.0) - whole / 3 * back[i, k])
                fading[m, i, k] = keep * fading[m, i, k] + half * (now - before[m, i, k])
                before[m, i, k] = now
                spent += fading[m, i, k] * right[i, k]
        for i in range(3):
            for k in range(3):
                total = 0.0
                for j in range(3):
                    total += F[i, j] * (fading[m, j, k] - spent / 3 * back[j, k])
                P[i, k] = total
        scatter(P, cells, slope, volume, m, force)


def draw(scene, rng, name):
    hold = scene.holds[0]
    longest = (hold.release - hold.arrive) / scene.fps / 3
    return Hidden(name, numbers={"tau": (rng.uniform(0.15, longest), "s")})


def apply(model, hidden):
    modulus = hidden.magnitude * model.scene.law.mu
    patch = model.patch()
    memory = np.zeros((len(patch.cells), 3, 3))
    return model.with_force(Branch(patch, modulus, hidden.number("tau"), memory, memory.copy()), mu=modulus)


EFFECT = Effect(draw=draw, apply=apply, parameter="g", unit="1", start=0.5, most=8.0)
