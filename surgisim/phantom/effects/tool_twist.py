"""The jaws turn while they hold, and nobody records it.

    u = p(t) + (R(angle(t)) - 1) (X - c)                              [m]

Not in the catalogue: grips there are carried without turning.
"""

import math
from dataclasses import replace

import numpy as np

from surgisim.artifacts.character import Truly
from surgisim.phantom.effect import Effect, Hidden, in_phase
from surgisim.phantom.timeline import ease


def draw(scene, rng, name):
    hold = scene.holds[0]
    onset = in_phase(scene, rng, 0.3, 1.4)
    axis = scene.shape.axes[2] + 0.5 * rng.standard_normal(3)
    return Hidden(
        name,
        center=scene.shape.upper(hold.grip.uv),
        extent=hold.grip.radius,
        onset=onset,
        end=scene.time(hold.release),
        numbers={
            "rise": (rng.uniform(0.4, 0.8), "s"),
            "axis": ((axis / np.linalg.norm(axis) * rng.choice([-1, 1])).tolist(), "1"),
        },
    )


def apply(model, hidden):
    axis, carried = hidden.vector("axis"), model.grasp[0]

    def turning(t, rest):
        angle = hidden.magnitude * float(ease((t - hidden.onset) / hidden.number("rise")))
        arm = rest - hidden.center
        # Rodrigues' formula.
        turned = math.sin(angle) * np.cross(axis, arm) + (1 - math.cos(angle)) * np.cross(axis, np.cross(axis, arm))
        return carried(t, rest) + turned

    return replace(model, grasp=(turning, *model.grasp[1:]))


# It turns the tissue as long as the grip holds, and is over with it.
CHARACTER = Truly(at_rest=(False, None), change=("fades", "grows"), energy=("gives",), local=(True,))
EFFECT = Effect(
    draw=draw, apply=apply, parameter="angle", unit="rad", start=0.8, most=1.6, outside=True, character=CHARACTER
)
