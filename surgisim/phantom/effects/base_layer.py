"""The deepest part of the tissue is stiffer, or softer, than the rest.

mu, lambda -> m mu, lambda below a depth
"""

import numpy as np

from surgisim.phantom.effect import Effect, Hidden


def draw(scene, rng, name):
    softer = 1.0 if rng.uniform() < 0.5 else 0.0
    thick = rng.uniform(0.3, 0.5) * scene.shape.thickness
    return Hidden(name, numbers={"thickness": (thick, "m"), "softer": (softer, "1")})


def factor(scene, hidden):
    return (1 + hidden.magnitude) ** (-1 if hidden.number("softer") else 1)


def apply(model, hidden):
    shape = model.scene.shape
    above = shape.thickness - (model.centers - shape.center) @ shape.axes[2]
    edge = 0.15 * hidden.number("thickness")
    s = np.clip((hidden.number("thickness") - above) / edge / 2 + 0.5, 0, 1)
    return model.with_moduli(factor(model.scene, hidden) ** (s * s * (3 - 2 * s)))


EFFECT = Effect(draw=draw, apply=apply, parameter="factor", unit="1", start=1.0, most=12.0, value=factor)
