"""A second, unrecorded grip pulls the opposite way for a while.

    f = k (b + p(t) - x) on a patch, p growing to A against the recorded pull                      [N]

Not in the catalogue: a bilateral hold that moves.
"""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.character import Truly
from surgisim.phantom.effect import Effect, Hidden, in_phase, near_grip
from surgisim.phantom.loads import window

RISE = 0.5
"""How long it pulls and yields [s]."""
GRASP = 0.1
"""How long it closes and opens [s]."""
STIFF = 8.0
"""Of the jaws, over E times the patch's radius, once they pull by FIRM."""
FIRM = 2e-3
"""[m]; a grip that hardly pulls hardly holds."""


@dataclass(frozen=True)
class Jaws:
    nodes: np.ndarray
    stiffness: np.ndarray
    rest: np.ndarray
    pull: np.ndarray
    hidden: Hidden

    def add(self, x, v, t, dt, force):
        begin, end = self.hidden.onset, self.hidden.end
        closed = window(begin, end, GRASP)(t)
        if closed > 0.0:
            target = self.rest + window(begin, end, RISE)(t) * self.pull
            force[self.nodes] += closed * self.stiffness[:, None] * (target - x[self.nodes])


def draw(scene, rng, name):
    at = near_grip(scene, rng, (0.014, 0.026), (0.0, 0.1), rim=0.006)
    begin = in_phase(scene, rng, 0.2, 1.2)
    against = -scene.holds[0].pull / np.linalg.norm(scene.holds[0].pull)
    # It can lift, but hardly push down.
    into = max(float(against @ scene.shape.axes[2]), 0.0)
    against = against - 2 * into * scene.shape.axes[2]
    return Hidden(
        name,
        center=at,
        extent=rng.uniform(0.0035, 0.005),
        onset=begin,
        end=min(begin + rng.uniform(1.2, 2.0), scene.end_of_fit - 0.2),
        numbers={"direction": (against.tolist(), "1")},
    )


def apply(model, hidden):
    points = model.mesh.points
    share = hidden.share(points) * model.parts.mass * ~model.mesh.fixed * ~model.mesh.gripped.any(0)
    nodes = np.flatnonzero(share > 1e-3 * share.max())
    firm = min(hidden.magnitude / FIRM, 1.0)
    stiffness = firm * STIFF * model.scene.law.E * hidden.extent * share[nodes] / share.sum()
    pull = hidden.magnitude * hidden.vector("direction")
    return model.with_force(Jaws(nodes, stiffness, points[nodes], pull, hidden))


# It lets go again before the fitted frames end, maybe before the recorded grip does. Which of the two pulls the other
# along is a matter of when they move, so that the sign of its work is not asked for.
CHARACTER = Truly(at_rest=(True, None), change=("fades",), local=(True,))
EFFECT = Effect(
    draw=draw, apply=apply, parameter="displacement", unit="m", start=3e-3, most=9e-3, outside=True, character=CHARACTER
)
