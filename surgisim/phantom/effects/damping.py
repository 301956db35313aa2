"""A lump of tissue that is slower to deform than the rest.

sigma += 2 e w(X) D                                               [Pa]
"""

from surgisim.phantom.effect import Effect, Hidden, near_grip


def draw(scene, rng, name):
    at = near_grip(scene, rng, (0.006, 0.016), (0.1, 0.5))
    return Hidden(name, center=at, extent=rng.uniform(0.008, 0.014))


def apply(model, hidden):
    return model.with_viscosity(hidden.magnitude * hidden.share(model.centers))


EFFECT = Effect(draw=draw, apply=apply, parameter="eta", unit="Pa s", start=10.0, most=40.0, faint=True)
