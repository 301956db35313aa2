"""Something that nobody sees pushes for a while: a second instrument under the rim, or a neighbour organ.

f = A d w(X) / sum w, while it touches                            [N]
"""

import math

import numpy as np

from surgisim.phantom.effect import Effect, Hidden, in_phase, near_grip
from surgisim.phantom.loads import Load, window

RISE = 0.12
"""How long it takes to come and to leave [s]."""


def draw(scene, rng, name):
    at = near_grip(scene, rng, (scene.holds[0].grip.radius + 0.005, 0.028), (0.0, 0.3))
    begin = in_phase(scene, rng, 0.0, 2.0)
    end = min(begin + rng.uniform(0.5, 1.2), scene.end_of_fit - 0.2)
    turn, lean = rng.uniform(0, 2 * np.pi), rng.uniform(0.2, 1.2)
    shape = scene.shape.axes
    push = math.cos(lean) * shape[2] + math.sin(lean) * (math.cos(turn) * shape[0] + math.sin(turn) * shape[1])
    return Hidden(
        name,
        center=at,
        extent=rng.uniform(0.004, 0.007),
        onset=begin,
        end=end,
        numbers={"direction": (push.tolist(), "1")},
    )


def apply(model, hidden):
    share = hidden.share(model.mesh.points) * model.parts.mass * ~model.mesh.fixed
    pattern = force(model.scene, hidden) * (share / share.sum())[:, None] * hidden.vector("direction")
    return model.with_force(Load(pattern, window(hidden.onset, hidden.end, RISE)))


def force(scene, hidden):
    """[N]"""
    return hidden.magnitude * scene.law.E * hidden.extent**2


EFFECT = Effect(draw=draw, apply=apply, parameter="force", unit="N", start=1.0, most=3.5, value=force)
