"""A lump of tissue swells: fluid runs in, or it is heated.

    P += -3 K e(t) w(X) J F^-T,  K = lambda + 2 mu / 3,  e grows from an onset on                  [Pa]

Not in the catalogue. Linear in the strain of swelling, as in thermoelasticity.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from surgisim.artifacts.character import Truly
from surgisim.phantom.effect import Effect, Hidden, in_phase, near_grip
from surgisim.phantom.forces import FAST
from surgisim.phantom.strains import Patch, cofactor, gradient, scatter
from surgisim.phantom.timeline import ease


@dataclass(frozen=True)
class Growth:
    patch: Patch
    pressure: float
    onset: float
    rise: float

    def add(self, x, v, t, dt, force):
        pressure = self.pressure * float(ease((t - self.onset) / self.rise))
        if pressure != 0.0:
            _add(x, *self.patch.args, pressure, force)


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _add(x, cells, slope, volume, pressure, force):
    F, C = np.empty((3, 3)), np.empty((3, 3))
    for m in range(len(cells)):
        gradient(x, cells, slope, m, F)
        cofactor(F, C)
        for i in range(3):
            for k in range(3):
                C[i, k] *= -pressure
        scatter(C, cells, slope, volume, m, force)


def draw(scene, rng, name):
    at = near_grip(scene, rng, (0.008, 0.026), (0.2, 0.6))
    begin = in_phase(scene, rng, 0.0, 1.8)
    return Hidden(
        name, center=at, extent=rng.uniform(0.005, 0.008), onset=begin, numbers={"rise": (rng.uniform(0.8, 2.0), "s")}
    )


def apply(model, hidden):
    law = model.scene.law
    pressure = (3 * law.lam + 2 * law.mu) * hidden.magnitude
    share = model.patch(hidden.share(model.centers))
    return model.with_force(Growth(share, pressure, hidden.onset, hidden.number("rise")))


# It grows for a second or two, whatever loads the tissue, pushes the tissue apart, and stays.
CHARACTER = Truly(at_rest=(True,), change=("grows",), energy=("gives",), local=(True,))
EFFECT = Effect(
    draw=draw, apply=apply, parameter="strain", unit="1", start=0.05, most=0.3, outside=True, character=CHARACTER
)
