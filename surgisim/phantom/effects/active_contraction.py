"""Muscle that contracts in waves, whether it is touched or not.

P = T(X, t) F a (x) a,  T = T0 max(0, sin(2 pi (t / period - X . n / length)))^2 after the onset      [Pa]
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from surgisim.phantom.effect import Effect, Hidden, along_tissue, in_phase
from surgisim.phantom.forces import FAST
from surgisim.phantom.strains import Patch, gradient, scatter
from surgisim.phantom.timeline import ease


@dataclass(frozen=True)
class Muscle:
    patch: Patch
    lag: np.ndarray
    """Phase of each element [rad], (M,)."""
    tension: float
    a: np.ndarray
    onset: float
    rate: float
    """[rad/s]."""

    def add(self, x, v, t, dt, force):
        up = float(ease((t - self.onset) / 0.3))
        if up > 0.0:
            _add(x, *self.patch.args, up * self.tension, self.rate * (t - self.onset), self.lag, self.a, force)


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _add(x, cells, slope, volume, tension, phase, lag, a, force):
    F, P, turned = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for m in range(len(cells)):
        wave = np.sin(phase - lag[m])
        if wave <= 0.0:
            continue
        gradient(x, cells, slope, m, F)
        for i in range(3):
            turned[i] = F[i, 0] * a[0] + F[i, 1] * a[1] + F[i, 2] * a[2]
        for i in range(3):
            for k in range(3):
                P[i, k] = tension * wave * wave * turned[i] * a[k]
        scatter(P, cells, slope, volume, m, force)


def draw(scene, rng, name):
    return Hidden(
        name,
        onset=0.0 if rng.uniform() < 0.4 else in_phase(scene, rng, 0.0, 2.0),
        numbers={
            "period": (rng.uniform(0.8, 2.0), "s"),
            "wavelength": (rng.uniform(0.02, 0.06), "m"),
            "direction": (along_tissue(scene, rng), "1"),
        },
    )


def apply(model, hidden):
    a = hidden.vector("direction")
    lag = 2 * math.pi * (model.centers - model.scene.shape.center) @ a / hidden.number("wavelength")
    tension = hidden.magnitude * model.scene.law.E
    rate = 2 * math.pi / hidden.number("period")
    return model.with_force(Muscle(model.patch(), lag, tension, a, hidden.onset, rate), mu=tension)


EFFECT = Effect(
    draw=draw,
    apply=apply,
    parameter="tension",
    unit="Pa",
    start=0.2,
    most=0.8,
    value=lambda scene, hidden: hidden.magnitude * scene.law.E,
)
