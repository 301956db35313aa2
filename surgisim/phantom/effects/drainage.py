"""Tissue that is squeezed dry, and drawn full, within seconds: its bulk stiffness fades, its shear stiffness stays.

    P += -m lambda q J F^-T,  q' = (J - 1 - q) / tau                  [Pa]

Not in the catalogue: the drained limit of a biphasic solid without its flow (Mow et al., J. Biomech. Eng. 102, 1980).
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from surgisim.artifacts.character import Truly
from surgisim.phantom.effect import Effect, Hidden
from surgisim.phantom.forces import FAST
from surgisim.phantom.strains import Patch, cofactor, gradient, scatter


@dataclass(frozen=True)
class Sponge:
    patch: Patch
    bulk: float
    tau: float
    drained: np.ndarray
    """q, (M,)."""

    def add(self, x, v, t, dt, force):
        _add(x, *self.patch.args, self.bulk, 1 - math.exp(-dt / self.tau), self.drained, force)


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _add(x, cells, slope, volume, bulk, follow, drained, force):
    F, C = np.empty((3, 3)), np.empty((3, 3))
    for m in range(len(cells)):
        gradient(x, cells, slope, m, F)
        J = cofactor(F, C)
        drained[m] += follow * (J - 1 - drained[m])
        for i in range(3):
            for k in range(3):
                C[i, k] *= -bulk * drained[m]
        scatter(C, cells, slope, volume, m, force)


def draw(scene, rng, name):
    return Hidden(name, numbers={"tau": (rng.uniform(0.2, 0.7), "s")})


def apply(model, hidden):
    patch = model.patch()
    bulk = hidden.magnitude * model.scene.law.lam
    return model.with_force(Sponge(patch, bulk, hidden.number("tau"), np.zeros(len(patch.cells))))


# Only what is loaded drains; then resistance fades, and work is lost on the way.
CHARACTER = Truly(at_rest=(False,), change=("fades",), energy=("takes",), local=(False,))
EFFECT = Effect(
    draw=draw, apply=apply, parameter="fading", unit="1", start=0.6, most=0.97, outside=True, character=CHARACTER
)
