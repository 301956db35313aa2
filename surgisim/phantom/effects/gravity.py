"""The table is tilted: gravity turns or grows, and the tissue, in balance before, sags.

f = rho (g' - g)                                                  [N/m^3]
"""

import numpy as np

from surgisim.phantom.effect import Effect, Hidden, in_phase
from surgisim.phantom.loads import Load, onset

RISE = 0.12
"""How long the change takes [s]."""


def draw(scene, rng, name):
    direction = rng.standard_normal(3)
    begin = 0.0 if rng.uniform() < 0.4 else in_phase(scene, rng, 0.0, 2.3)
    change = (direction / np.linalg.norm(direction)).tolist()
    return Hidden(name, onset=begin, numbers={"direction": (change, "1")})


def apply(model, hidden):
    pattern = model.parts.mass[:, None] * hidden.magnitude * hidden.vector("direction")
    return model.with_force(Load(pattern, onset(hidden.onset, RISE)))


EFFECT = Effect(draw=draw, apply=apply, parameter="change", unit="m/s^2", start=1.0, most=2 * 9.81)
