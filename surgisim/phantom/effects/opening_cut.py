"""A cut opens while the tissue is held: along a plane beside the grip it comes apart within a moment.

    mu, lambda -> (1 - s(t) w(X)) mu, lambda                          w: 1 in a thin slab from the upper side down

Not in the catalogue: what fails does so at a time, not at a strain.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from surgisim.artifacts.character import Truly
from surgisim.phantom.effect import Effect, Hidden, near_grip
from surgisim.phantom.model import in_lanes
from surgisim.phantom.timeline import ease

RISE = 0.15
"""How long it opens [s]."""
LEFT = 0.03
"""Share of the stiffness that stays in the cut."""


@dataclass(frozen=True)
class Opening:
    """Adds no force: it softens the elements of the model that holds it."""

    share: np.ndarray
    whole: tuple[np.ndarray, np.ndarray]
    now: tuple[np.ndarray, np.ndarray]
    onset: float

    def add(self, x, v, t, dt, force):
        if self.onset < t <= self.onset + 1.2 * RISE:
            left = 1 - float(ease((t - self.onset) / RISE)) * (1 - LEFT) * self.share
            for whole, now in zip(self.whole, self.now, strict=True):
                now[:] = left * whole


def draw(scene, rng, name):
    hold = scene.holds[0]
    at = near_grip(scene, rng, (hold.grip.radius + 0.002, hold.grip.radius + 0.005), (0.0, 0.01))
    up, along = -scene.shape.axes[2], at - scene.shape.upper(hold.grip.uv)
    along = along - (along @ up) * up
    along /= np.linalg.norm(along)
    # Across the line to the grip, so that the pull opens it.
    turn = rng.uniform(-0.4, 0.4)
    cut = math.cos(turn) * np.cross(up, along) - math.sin(turn) * along
    begin = rng.uniform(hold.arrive + 2, (hold.arrive + hold.release) / 2) / scene.fps
    numbers = {"along": (cut.tolist(), "1"), "depth": (rng.uniform(0.7, 0.95), "1")}
    return Hidden(name, center=at, extent=None, onset=begin, numbers=numbers)


def length(scene, hidden):
    """[m]"""
    return hidden.magnitude * 0.02


def apply(model, hidden):
    along, shape = hidden.vector("along"), model.scene.shape
    off = model.centers - hidden.center
    edge = 0.0035
    across = np.abs(off @ np.cross(shape.axes[2], along))
    deep = hidden.number("depth") * shape.thickness
    slab = [
        (1.1 * edge - across) / edge,
        (length(model.scene, hidden) / 2 - np.abs(off @ along)) / edge,
        (deep - np.abs(off @ shape.axes[2])) / edge + 0.5,
    ]
    share = in_lanes(np.prod([np.clip(s, 0, 1) for s in slab], axis=0))
    parts = model.parts
    now = parts.mu.copy(), parts.lam.copy()
    law = Opening(share, (parts.mu.copy(), parts.lam.copy()), now, hidden.onset)
    return replace(model, parts=replace(parts, mu=now[0], lam=now[1])).with_force(law)


# It opens within a moment and stays open; what was stored in the cut is lost. Where nothing pulls nothing shows.
CHARACTER = Truly(at_rest=(False,), change=("holds",), energy=("takes",), local=(True,))
EFFECT = Effect(
    draw=draw,
    apply=apply,
    parameter="length",
    unit="m",
    start=0.8,
    most=2.0,
    value=length,
    outside=True,
    character=CHARACTER,
)
