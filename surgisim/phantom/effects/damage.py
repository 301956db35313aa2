"""Tissue that tears a little once it is strained beyond what it bears, and stays softer.

    mu, lambda -> (1 - d) mu, lambda,  d = D (1 - exp(-(e - e0) / w)),  e the largest strain so far

with e = sqrt((I1' - 3) / 3). Simo and Ju, Strain- and stress-based continuum damage models, IJSS 23 (1987).
"""

from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from surgisim.phantom.effect import Effect, Hidden
from surgisim.phantom.elements import LANES
from surgisim.phantom.forces import FAST
from surgisim.phantom.strains import Patch, cofactor, gradient, square


@dataclass(frozen=True)
class Tearing:
    """Adds no force: it softens the elements of the model that holds it."""

    patch: Patch
    most: float
    bears: float
    width: float
    worst: np.ndarray
    """Largest strain so far, (M,)."""
    whole: tuple[np.ndarray, np.ndarray]
    """mu and lambda without damage [Pa], (B, LANES)."""
    now: tuple[np.ndarray, np.ndarray]
    """The model's own, written into."""

    def add(self, x, v, t, dt, force):
        _soften(
            x, self.patch.cells, self.patch.slope, self.most, self.bears, self.width, self.worst, *self.whole, *self.now
        )


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _soften(x, cells, slope, most, bears, width, worst, mu, lam, mu_now, lam_now):
    F, C = np.empty((3, 3)), np.empty((3, 3))
    for m in range(len(cells)):
        gradient(x, cells, slope, m, F)
        J = cofactor(F, C)
        strain = np.sqrt(max(J ** (-2.0 / 3.0) * square(F) / 3 - 1, 0.0))
        if strain > worst[m] and strain > bears:
            worst[m] = strain
            left = 1 - most * (1 - np.exp(-(strain - bears) / width))
            b, lane = m // LANES, m % LANES
            mu_now[b, lane] = left * mu[b, lane]
            lam_now[b, lane] = left * lam[b, lane]


def draw(scene, rng, name):
    return Hidden(name, numbers={"bears": (rng.uniform(0.06, 0.16), "1"), "width": (rng.uniform(0.05, 0.2), "1")})


def apply(model, hidden):
    parts = model.parts
    now = parts.mu.copy(), parts.lam.copy()
    patch = model.patch()
    law = Tearing(
        patch,
        hidden.magnitude,
        hidden.number("bears"),
        hidden.number("width"),
        np.zeros(len(patch.cells)),
        (parts.mu.copy(), parts.lam.copy()),
        now,
    )
    return replace(model, parts=replace(parts, mu=now[0], lam=now[1])).with_force(law)


EFFECT = Effect(draw=draw, apply=apply, parameter="most", unit="1", start=0.6, most=0.95)
