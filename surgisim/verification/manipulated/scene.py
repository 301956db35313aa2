"""A block of tissue that is pulled, held, let go, and pulled again elsewhere: what a seed decides."""

import math
from dataclasses import dataclass

import numpy as np

from surgisim.phantom.block import Grip, Shape
from surgisim.phantom.law import Law
from surgisim.phantom.timeline import ease

PHASES = ("load", "hold", "release", "rest")
"""What `Scene.phase` counts."""
FPS = 25.0
"""Frames a second, as a clip has."""
FINE = 10
"""Instants a frame at which both solvers are read: a rebound is over within two frames."""
GRASP, PULL, HOLD, LEAVE = 2, 14, 8, 26
"""Frames from 0 to the first grasp, of its pull, of its hold, and from release to the second grasp."""
PULL_2, HOLD_2, LEAVE_2 = 10, 6, 12
"""The same of the second grip."""
DENSITY = 1050.0
"""Of the tissue [kg/m^3]."""


@dataclass(frozen=True)
class Hold:
    """One grip: where, how far, and when."""

    grip: Grip
    pull: np.ndarray
    """Displacement it arrives at, camera frame [m], (3,)."""
    begin: int
    """Frame at which it closes and sets off."""
    arrive: int
    """Frame at which the pull has arrived."""
    release: int
    """Frame after which the tissue is free."""

    def path(self, frames: np.ndarray) -> np.ndarray:
        """Displacement at times in frames [m], (S, 3)."""
        return ease((frames - self.begin) / (self.arrive - self.begin))[:, None] * self.pull


@dataclass(frozen=True)
class Scene:
    seed: int
    shape: Shape
    law: Law
    holds: tuple[Hold, Hold]
    frames: int

    def clock(self) -> np.ndarray:
        """Times at which both solvers are read, in frames, (T,)."""
        return np.arange((self.frames - 1) * FINE + 1) / FINE

    def probes(self, pitch: float = 2.5e-3, rim: float = 1.5e-3) -> np.ndarray:
        """Surface points that are compared, u and v [m], (K, 2)."""
        axes = [
            np.linspace(low + rim, high - rim, round((high - low - 2 * rim) / pitch) + 1)
            for low, high in zip(self.shape.low, self.shape.high, strict=True)
        ]
        return np.stack(np.meshgrid(*axes), -1).reshape(-1, 2)

    def phase(self) -> np.ndarray:
        """0 before and while loading, 1 held, 2 the half second after a release, 3 rest, at every frame, (frames,)."""
        phase = np.full(self.frames, 3)
        for hold in self.holds:
            phase[hold.begin : hold.arrive] = 0
            phase[hold.arrive : hold.release + 1] = 1
            phase[hold.release + 1 : hold.release + 1 + round(0.5 * FPS)] = 2
        phase[0] = 0
        return phase


def invent(seed: int) -> Scene:
    """The scene of a seed: block 14-18 mm thick, E 2-8 kPa, nu .40-.47, a pull of 7-10 mm, then one of 3-5 mm."""
    rng = np.random.default_rng([seed, *b"manipulation"])
    size = rng.uniform([0.058, 0.040], [0.062, 0.046])
    E = 1e3 * math.exp(rng.uniform(math.log(2), math.log(8)))
    law = Law(E, rng.uniform(0.40, 0.47), E * rng.uniform(1e-3, 3e-3), DENSITY)
    shape = Shape(np.array([0.0, 0.0, 0.07]), _axes(rng), -size / 2, size / 2, rng.uniform(0.014, 0.018), _waves(rng))
    radii = rng.uniform(4.5e-3, 6.5e-3, 2)
    side = rng.choice([-1.0, 1.0])
    first = np.array([side * rng.uniform(0.006, 0.010), rng.uniform(-0.005, 0.005)])
    second = np.array([-side * rng.uniform(0.012, 0.015), rng.uniform(-0.007, 0.007)])
    begin, release = GRASP, GRASP + PULL + HOLD
    again, let_go = release + LEAVE, release + LEAVE + PULL_2 + HOLD_2
    holds = (
        Hold(Grip(first, radii[0]), _pull(shape, rng, rng.uniform(7e-3, 10e-3)), begin, begin + PULL, release),
        Hold(Grip(second, radii[1]), _pull(shape, rng, rng.uniform(3e-3, 5e-3)), again, again + PULL_2, let_go),
    )
    return Scene(seed, shape, law, holds, let_go + LEAVE_2 + 1)


def _axes(rng: np.random.Generator) -> np.ndarray:
    """The block's frame: slanted against the view and turned about it, so that no grid is aligned with it."""
    slant, towards, turn = rng.uniform(0.0, 0.35), rng.uniform(0, 2 * np.pi), rng.uniform(0, 2 * np.pi)
    depth = np.array([math.sin(slant) * math.cos(towards), math.sin(slant) * math.sin(towards), math.cos(slant)])
    u = np.cross([-math.sin(turn), math.cos(turn), 0.0], depth)
    u /= np.linalg.norm(u)
    return np.stack([u, np.cross(depth, u), depth])


def _waves(rng: np.random.Generator, count: int = 10) -> np.ndarray:
    """Gentle hills of 0.6-1.4 mm RMS, as the phantom's."""
    relief, length, heading = (
        rng.uniform(0.6e-3, 1.4e-3),
        rng.uniform(0.016, 0.045, count),
        rng.uniform(0, 2 * np.pi, count),
    )
    height = length / np.sqrt(np.sum(length**2) / 2) * relief
    number = (2 * np.pi / length)[:, None] * np.stack([np.cos(heading), np.sin(heading)], 1)
    return np.concatenate([number, rng.uniform(0, 2 * np.pi, count)[:, None], height[:, None]], 1)


def _pull(shape: Shape, rng: np.random.Generator, length: float) -> np.ndarray:
    """Oblique: 20-60 degrees above the tissue's plane, in any direction."""
    lift, turn = rng.uniform(0.35, 1.05), rng.uniform(0, 2 * np.pi)
    along = math.cos(turn) * shape.axes[0] + math.sin(turn) * shape.axes[1]
    return length * (math.sin(lift) * -shape.axes[2] + math.cos(lift) * along)
