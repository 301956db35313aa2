"""The base breathes, from the first frame on.

u = A (s(t) - s(0)) d,  s = sin(2 pi f t + p) + h sin(4 pi f t + q)                            [m]
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from surgisim.phantom.effect import Effect, Hidden
from surgisim.phantom.timeline import ease

RISE = 0.3
"""The recording begins between breaths: the motion comes up within this time [s]."""


@dataclass(frozen=True)
class Breathing:
    nodes: np.ndarray
    rest: np.ndarray
    hidden: Hidden

    def hold(self, x, v, t, dt):
        v[self.nodes] = (self.rest + shift(self.hidden, t) - x[self.nodes]) / dt


def shift(hidden, t):
    f = 2 * math.pi * hidden.number("frequency")
    p, q, h = (hidden.number(n) for n in ("phase", "phase_2", "harmonic"))
    wave = math.sin(f * t + p) + h * math.sin(2 * f * t + q) - math.sin(p) - h * math.sin(q)
    return hidden.magnitude * wave * float(ease(t / RISE)) * hidden.vector("direction")


def draw(scene, rng, name):
    turn, lean = rng.uniform(0, 2 * np.pi), rng.uniform(0.0, 0.9)
    direction = [math.sin(lean) * math.cos(turn), math.sin(lean) * math.sin(turn), math.cos(lean)]
    numbers = {
        "frequency": (rng.uniform(0.25, 0.6), "1/s"),
        "phase": (rng.uniform(0, 2 * np.pi), "rad"),
        "harmonic": (rng.uniform(0, 0.35), "1"),
        "phase_2": (rng.uniform(0, 2 * np.pi), "rad"),
        "direction": (direction, "1"),
    }
    return Hidden(name, numbers=numbers)


def apply(model, hidden):
    nodes = np.flatnonzero(model.mesh.fixed)
    return replace(model, support=Breathing(nodes, model.mesh.points[nodes], hidden))


EFFECT = Effect(draw=draw, apply=apply, parameter="amplitude", unit="m", start=5e-4, most=4e-3)
