"""A block of tissue that is pulled, held, let go, and pulled again elsewhere: what a seed decides."""

import math
from dataclasses import dataclass, replace

import numpy as np

from surgisim.phantom.block import Grip, Shape
from surgisim.phantom.law import Law
from surgisim.phantom.ogrid import even
from surgisim.phantom.timeline import ease

DENSITY = 1050.0
"""Of the tissue [kg/m^3]."""
VISCOUS = 12.0
"""Largest viscosity [Pa s]: explicit steps shrink with it."""
GRAVITY = 9.81
"""[m/s^2]."""


@dataclass(frozen=True)
class Hold:
    """One grip: where, how far, and when; it closes and opens on frames, or shares of a frame beside them."""

    grip: Grip
    pull: np.ndarray
    """Displacement it arrives at [m], (3,)."""
    begin: int
    """Frame at which it closes and sets off."""
    arrive: int
    """Frame at which the pull has arrived."""
    release: int
    """Frame after which the tissue is free."""
    close_phase: float = 0.0
    """Share of a frame by which it closes before `begin`, still at rest [1]."""
    release_phase: float = 0.0
    """Share of a frame by which it opens after `release` [1]."""

    def path(self, frames: np.ndarray) -> np.ndarray:
        """Displacement at times in frames [m], (S, 3)."""
        return ease((np.asarray(frames) - self.begin) / (self.arrive - self.begin))[..., None] * self.pull


@dataclass(frozen=True)
class Scene:
    """Everything but what is concealed. The tissue's depth runs along -z; the base is level."""

    shape: Shape
    law: Law
    holds: tuple[Hold, Hold]
    frames: int
    fps: float
    split: int
    """First frame that is held out: some time before the second grip closes."""
    gravity: np.ndarray
    """In balance with the tissue at rest [m/s^2], (3,)."""
    probes: np.ndarray
    """Tracked points, u and v [m], (K, 2)."""

    def time(self, frame: float) -> float:
        """[s]"""
        return frame / self.fps

    @property
    def end_of_fit(self) -> float:
        """[s]"""
        return self.split / self.fps

    def pulled(self, share: float) -> "Scene":
        """The same with pulls of this share of their length."""
        first, second = (replace(hold, pull=share * hold.pull) for hold in self.holds)
        return replace(self, holds=(first, second))

    def between_frames(self, close_phase: float, release_phase: float) -> "Scene":
        """The same with grips that close and open these shares of a frame [1] outside their active frames."""
        first, second = (replace(h, close_phase=close_phase, release_phase=release_phase) for h in self.holds)
        return replace(self, holds=(first, second))

    def lagging(self, lag: float) -> "Scene":
        """The same tissue with a viscosity of `lag` [s] times its Young's modulus."""
        return replace(self, law=replace(self.law, eta=lag * self.law.E))


def draw(rng: np.random.Generator, *, fps: float, points: int, spacings: tuple[float, ...]) -> Scene:
    """Block 45-65 x 35-50 x 12-18 mm, E 1-10 kPa, nu .40-.48, eta/E 1-8 ms; pulls of 7-11 and 4-7 mm.

    Only blocks and grips that meshes of all `spacings` [m] fit well, and eta up to VISCOUS.
    """
    while True:
        E, lag = 1e3 * math.exp(rng.uniform(0, math.log(10))), 1e-3 * math.exp(rng.uniform(0, math.log(8)))
        if E * lag <= VISCOUS:
            break
    law = Law(E, rng.uniform(0.40, 0.48), E * lag, DENSITY)
    while True:
        size, thickness = rng.uniform([0.045, 0.035], [0.065, 0.050]), rng.uniform(0.012, 0.018)
        shape = Shape(rng.uniform(-0.02, 0.02, 3), _axes(rng), -size / 2, size / 2, thickness, _waves(rng))
        grips = _grips(rng, shape)
        if all(even(shape, grips, spacing) for spacing in spacings):
            break
    rest, load, hold = rng.uniform(0.3, 0.6), rng.uniform(0.5, 0.9), rng.uniform(1.4, 2.2)
    after, load_2, hold_2, after_2 = rng.uniform(1.2, 1.7), rng.uniform(0.4, 0.7), rng.uniform(0.4, 0.8), 0.5
    marks = np.rint(np.cumsum([rest, load, hold, after, load_2, hold_2, after_2]) * fps).astype(int).tolist()
    lengths = rng.uniform(7e-3, 11e-3), rng.uniform(4e-3, 7e-3)
    pulls = [_pull(shape, rng, length) for length in lengths]
    return Scene(
        shape,
        law,
        (Hold(grips[0], pulls[0], *marks[:3]), Hold(grips[1], pulls[1], *marks[3:6])),
        marks[6] + 1,
        fps,
        marks[3] - round(0.15 * fps),
        np.array([0.0, 0.0, -GRAVITY]),
        _probes(rng, shape, points),
    )


def _axes(rng: np.random.Generator) -> np.ndarray:
    """Depth along -z, u turned about it, so that no grid is aligned with the block."""
    turn = rng.uniform(0, 2 * np.pi)
    u, depth = np.array([math.cos(turn), math.sin(turn), 0.0]), np.array([0.0, 0.0, -1.0])
    return np.stack([u, np.cross(depth, u), depth])


def _waves(rng: np.random.Generator, count: int = 10) -> np.ndarray:
    """Gentle hills of 0.5-1.2 mm RMS."""
    relief, length = rng.uniform(0.5e-3, 1.2e-3), rng.uniform(0.016, 0.045, count)
    heading = rng.uniform(0, 2 * np.pi, count)
    height = length / np.sqrt(np.sum(length**2) / 2) * relief
    number = (2 * np.pi / length)[:, None] * np.stack([np.cos(heading), np.sin(heading)], 1)
    return np.concatenate([number, rng.uniform(0, 2 * np.pi, count)[:, None], height[:, None]], 1)


def _grips(rng: np.random.Generator, shape: Shape) -> tuple[Grip, Grip]:
    """One near the middle, one elsewhere; `even` decides whether a mesh fits both."""
    radii = rng.uniform(4.5e-3, 6.0e-3, 2)
    uv = rng.uniform(shape.low + 0.011, shape.high - 0.011, (2, 2))
    return Grip(uv[0] * [0.7, 0.8], radii[0]), Grip(uv[1], radii[1])


def _pull(shape: Shape, rng: np.random.Generator, length: float) -> np.ndarray:
    """Oblique: 20-60 degrees above the tissue's plane, in any direction."""
    lift, turn = rng.uniform(0.35, 1.05), rng.uniform(0, 2 * np.pi)
    along = math.cos(turn) * shape.axes[0] + math.sin(turn) * shape.axes[1]
    return length * (math.sin(lift) * -shape.axes[2] + math.cos(lift) * along)


def _probes(rng: np.random.Generator, shape: Shape, points: int) -> np.ndarray:
    """Scattered evenly over the upper side, 1 mm from its rim: of many drawn, those that keep most apart."""
    low, high = shape.low + 1e-3, shape.high - 1e-3
    chosen = [rng.uniform(low, high)]
    nearest = np.full(20 * points, np.inf)
    many = rng.uniform(low, high, (20 * points, 2))
    while len(chosen) < points:
        nearest = np.minimum(nearest, ((many - chosen[-1]) ** 2).sum(1))
        # Not the farthest, which would make a lattice, but one of the far ones.
        far = np.argsort(nearest)[-max(points // 4, 1) :]
        chosen.append(many[rng.choice(far)])
    return np.array(chosen)
