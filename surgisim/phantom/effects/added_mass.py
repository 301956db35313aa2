"""Something is laid on, or in, the tissue: it weighs and it is slow to move.

m added in a ball, with its weight, from an onset on                                           [kg]
"""

from dataclasses import replace

from surgisim.phantom.effect import Effect, Hidden, in_phase, near_grip
from surgisim.phantom.loads import Load, onset

RISE = 0.15
"""How long it is being laid down [s]."""


def draw(scene, rng, name):
    at = near_grip(scene, rng, (scene.holds[0].grip.radius + 0.004, 0.026), (0.0, 0.3))
    begin = in_phase(scene, rng, -0.0, 2.0)
    return Hidden(name, center=at, extent=rng.uniform(0.005, 0.008), onset=begin)


def mass(scene, hidden):
    """[kg]"""
    return hidden.magnitude * scene.law.E * hidden.extent**2 / 9.81


def apply(model, hidden):
    share = hidden.share(model.mesh.points) * model.parts.mass * ~model.mesh.fixed
    added = mass(model.scene, hidden) * share / share.sum()
    come = onset(hidden.onset, RISE)
    return replace(model.with_force(Load(added[:, None] * model.scene.gravity, come)), burden=(added, come))


EFFECT = Effect(draw=draw, apply=apply, parameter="mass", unit="kg", start=0.5, most=3.0, value=mass)
