"""A lump of stiffer tissue.

mu, lambda -> (1 + m w(X)) mu, lambda                             w: 1 inside, 0 outside
"""

from surgisim.phantom.effect import Effect, Hidden, near_grip


def draw(scene, rng, name):
    radius = rng.uniform(0.006, 0.010)
    at = near_grip(scene, rng, (0.004, 0.012), (0.1, 0.5))
    return Hidden(name, center=at, extent=radius)


def apply(model, hidden):
    return model.with_moduli(1 + hidden.magnitude * hidden.share(model.centers))


EFFECT = Effect(
    draw=draw,
    apply=apply,
    parameter="factor",
    unit="1",
    start=3.0,
    most=25.0,
    value=lambda scene, hidden: 1 + hidden.magnitude,
)
