"""The jaws slide off: from some moment on the tissue follows them less and less.

u = (1 - s (1 - exp(-(t - t0) / tau))^2) p(t)                     p the tool's path
"""

import math
from dataclasses import replace

from surgisim.phantom.effect import Effect, Hidden, in_phase


def draw(scene, rng, name):
    onset = in_phase(scene, rng, 0.5, 1.6)
    return Hidden(
        name,
        center=scene.shape.upper(scene.holds[0].grip.uv),
        extent=scene.holds[0].grip.radius,
        onset=onset,
        end=scene.time(scene.holds[0].release),
        numbers={"tau": (rng.uniform(0.1, 0.6), "s")},
    )


def apply(model, hidden):
    tau, carried = hidden.number("tau"), model.grasp[0]

    def slipping(t, rest):
        # Begins gently: the square keeps the speed of the nodes continuous.
        late = max(t - hidden.onset, 0.0) / tau
        return (1 - hidden.magnitude * (1 - math.exp(-late)) ** 2) * carried(t, rest)

    return replace(model, grasp=(slipping, *model.grasp[1:]))


EFFECT = Effect(draw=draw, apply=apply, parameter="slipped", unit="1", start=0.3, most=0.9)
