"""One invented scene: everything that a seed and the settings decide, before any time passes."""

import math
from dataclasses import dataclass

import numpy as np

from surgisim.config.phantom import Phantom
from surgisim.phantom.block import Grip, Shape
from surgisim.phantom.instrument import Grasper
from surgisim.phantom.law import Law
from surgisim.phantom.shading import Lamp
from surgisim.phantom.timeline import Timeline
from surgisim.phantom.view import View


@dataclass(frozen=True)
class Case:
    view: View
    lamp: Lamp
    shape: Shape
    grip: Grip
    law: Law
    timeline: Timeline
    pull: np.ndarray
    """Displacement of the grip when held, camera frame [m], (3,)."""
    tool: Grasper


def invent(settings: Phantom) -> Case:
    """The scene of a seed. Each part draws from a generator of its own, so that one can change without the others."""
    view = View(settings.width, settings.height, settings.focal * settings.width)
    shape = _shape(settings, view, generator(settings.seed, "shape"))
    rng = generator(settings.seed, "grip")
    # The grip lies near the image's middle; the tool comes from the side nearer to it.
    aim = view.rays(np.array(view.center) + rng.uniform(-0.10, 0.10, 2) * [view.width, view.height])
    local = (aim * settings.distance - shape.center) @ shape.axes.T
    grip = Grip(local[:2], settings.grip_radius)
    side = rng.choice([-1.0, 1.0])
    port = np.array([side * 0.085, rng.uniform(0.015, 0.045), 0.022]) * settings.distance / 0.07
    sideways = side * shape.axes[0] * math.cos(turn := rng.uniform(-0.5, 0.5)) + shape.axes[1] * math.sin(turn)
    lift = settings.lift
    pull = settings.pull * (math.sin(lift) * -shape.axes[2] + math.cos(lift) * sideways)
    return Case(
        view,
        Lamp(settings.distance * 1.18, 0.35),
        shape,
        grip,
        Law(settings.E, settings.nu, settings.eta, settings.density),
        Timeline(settings.grasp, settings.load, settings.hold, settings.release, settings.duration),
        pull,
        Grasper(port, 0.0025, 0.011, rng.uniform(-0.5, 0.5)),
    )


def generator(seed: int, part: str) -> np.random.Generator:
    """A generator for one part of the scene."""
    return np.random.default_rng([seed, *part.encode()])


def _shape(settings: Phantom, view: View, rng: np.random.Generator) -> Shape:
    """A slanted slab that reaches a little beyond the image on all sides."""
    slant, towards = settings.slant, rng.uniform(-0.4, 0.4) + np.pi / 2 * rng.choice([-1, 1])
    depth = np.array([math.sin(slant) * math.cos(towards), math.sin(slant) * math.sin(towards), math.cos(slant)])
    u = np.cross([0.0, 1.0, 0.0], depth)
    u /= np.linalg.norm(u)
    axes = np.stack([u, np.cross(depth, u), depth])
    center = np.array([0.0, 0.0, settings.distance])
    corners = view.rays(np.array([[x, y] for x in (0, view.width - 1) for y in (0, view.height - 1)], float))
    margin = settings.margin
    plane = corners * ((center @ depth + 3 * settings.relief) / (corners @ depth))[:, None]
    flat = (plane - center) @ axes[:2].T
    count = 10
    length, heading = rng.uniform(0.016, 0.045, count), rng.uniform(0, 2 * np.pi, count)
    height = length / np.sqrt(np.sum(length**2) / 2) * settings.relief
    waves = np.stack([np.cos(heading), np.sin(heading), np.zeros(count), height], 1)
    waves[:, :2] *= (2 * np.pi / length)[:, None]
    waves[:, 2] = rng.uniform(0, 2 * np.pi, count)
    low, high = flat.min(0) - margin, flat.max(0) + margin
    if settings.dome:
        waves = np.concatenate([waves, _dome(low, high, settings.dome)])
    return Shape(center, axes, low, high, settings.thickness, waves)


def _dome(low: np.ndarray, high: np.ndarray, height: float) -> np.ndarray:
    """Half a wave across either side: `height` [m] in the middle, nothing at the corners; rows as Shape.waves'."""
    (u, v), (mid_u, mid_v) = np.pi / (high - low), 0.5 * (low + high)
    return np.array([[u, 0, -u * mid_u, 0.5 * height], [0, v, -v * mid_v, 0.5 * height]])
