"""The surface is slowed by what it moves through.

f = -c v on the upper side                                        [Pa s/m]
"""

from dataclasses import dataclass, replace

import numpy as np

from surgisim.phantom.effect import Effect, Hidden
from surgisim.phantom.model import Support


@dataclass(frozen=True)
class Dragged:
    """Stands where the support stands, because velocities shrink exactly, however strong the drag."""

    below: Support
    nodes: np.ndarray
    rate: np.ndarray
    """[1/s], (Q,)."""

    def hold(self, x, v, t, dt):
        v[self.nodes] *= np.exp(-self.rate * dt)[:, None]
        self.below.hold(x, v, t, dt)


def draw(scene, rng, name):
    return Hidden(name)


def apply(model, hidden):
    nodes = np.flatnonzero(model.mesh.upper)
    area = np.prod(model.scene.shape.high - model.scene.shape.low) / len(nodes)
    return replace(model, support=Dragged(model.support, nodes, hidden.magnitude * area / model.parts.mass[nodes]))


EFFECT = Effect(draw=draw, apply=apply, parameter="c", unit="Pa s/m", start=2e3, most=3e4, faint=True)
