"""Laws that a swinging body is tried with, their numbers in units of the body's own."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from surgisim.diagnosis.clip import Clip
from surgisim.mpm.setup import Values
from surgisim.physics.place import Place

EXTENT, SEAM = 0.05, 0.02
"""Over the body's length: extent of what acts in one place, and how gradually one part passes into the other."""
ALWAYS = {"onset": 0.0, "end": 60.0}
ALONG = (0.0, 0.5)
"""Places of what acts in one place, from the free end (0) to what is held (1), that are tried before a fit."""
Made = tuple[Values, dict[str, Place]]


@dataclass(frozen=True)
class Law:
    """A way in which the base may be wrong."""

    term: str
    make: Callable[[np.ndarray], Made]
    """Values and places from its own numbers."""
    scan: tuple[tuple[float, ...], ...]
    """Values of each number that are tried before a fit."""
    low: tuple[float, ...]
    high: tuple[float, ...]
    divides: int | None = None
    """Which number the base's modulus is to be divided by, so that tissue near what is held keeps its own."""


@dataclass(frozen=True)
class Frame:
    """A body's own units."""

    free: np.ndarray
    """Middle of the end farthest from what is held [m], (3,)."""
    held: np.ndarray
    """Middle of what is held [m], (3,)."""
    down: np.ndarray
    """Where weight pulls, (3,); zero where nothing is known of it."""
    mass: float
    """[kg]"""
    weight: float
    """[N]"""
    period: float
    """[s]"""
    E: float
    """Of the base [Pa]."""

    @property
    def length(self) -> float:
        return float(np.linalg.norm(self.held - self.free))

    @property
    def axis(self) -> np.ndarray:
        """From the free end to what is held, (3,)."""
        return (self.held - self.free) / self.length

    def along(self, share: float) -> tuple[float, float, float]:
        """In the middle, from the free end (0) to what is held (1) [m]."""
        x, y, z = self.free + float(share) * (self.held - self.free)
        return float(x), float(y), float(z)

    def somewhere(self, share: float) -> Place:
        return Place(self.along(share), EXTENT * self.length)


def frame_of(clip: Clip, x: np.ndarray, period: float) -> Frame:
    body = clip.body
    rest = body.rest.astype(float)
    held = rest[body.held].mean(0)
    away = np.linalg.norm(rest - held, axis=1)
    farthest = rest[away.argmax()]
    way = (farthest - held) / np.linalg.norm(farthest - held)
    # The face at the far end, not one of its corners; then straight along the body.
    reach = (rest - held) @ way
    end = rest[reach > reach.max() - body.spacing].mean(0)
    way = (end - held) / np.linalg.norm(end - held)
    free = held + way * ((rest - held) @ way).max()
    gravity = np.array(clip.recording.gravity or (0.0, 0.0, 0.0))
    size = float(np.linalg.norm(gravity))
    mass = float(clip.density * body.volume.sum())
    down = gravity / size if size else gravity
    return Frame(free, held, down, mass, mass * (size or 9.81), period, float(np.exp(x[0])))


def laws(frame: Frame, elastic: bool, settles: bool) -> list[Law]:
    """All that are tried.

    elastic: whether the base has no viscosity, which is then one of them; settles: whether only where the body came to
    rest is seen, of which what takes energy out says nothing.
    """
    found = [_mass(frame), _tilt(frame), _lump(frame), _part(frame), _stiffening(frame)]
    found += [_push(frame)] if frame.down.any() else []
    if settles:
        return found
    return [*([_viscosity(frame)] if elastic else []), _relaxation(frame), _drag(frame), *found]


def _viscosity(f: Frame) -> Law:
    unit = f.E * f.period / (2 * math.pi)
    tried = tuple(unit * loss for loss in (0.015, 0.05, 0.15))
    return Law("newtonian", lambda x: ({"newtonian": {"eta": x[0]}}, {}), (tried,), (1e-3 * unit,), (unit,))


def _relaxation(f: Frame) -> Law:
    tau = f.period / 2
    return Law(
        "relaxation", lambda x: ({"relaxation": {"G": x[0], "tau": x[1]}}, {}),
        (tuple(f.E * s for s in (0.02, 0.06, 0.2)), (tau,)), (1e-4 * f.E, 0.02), (f.E, 20.0),
    )  # fmt: skip


def _drag(f: Frame) -> Law:
    tried = tuple(2 * math.pi / f.period * s for s in (0.02, 0.1, 0.5))
    return Law("drag", lambda x: ({"drag": {"c": x[0]}}, {}), (tried,), (0.01,), (1e3,))


def _mass(f: Frame) -> Law:
    def make(x):
        return {"added_mass": {"mass": x[0]}}, {"added_mass": f.somewhere(x[1])}

    return Law("added_mass", make, (tuple(f.mass * s for s in (0.1, 0.4, 1.0)), ALONG), (1e-5, 0.0), (3 * f.mass, 1.0))


def _push(f: Frame) -> Law:
    """A force the way weight pulls, or against it."""

    def make(x):
        x_, y_, z_ = np.sign(x[0] or 1.0) * f.down
        yaw, pitch = math.atan2(x_, z_), math.asin(np.clip(y_, -1.0, 1.0))
        told = {"force": max(abs(x[0]), 1e-6), "yaw": yaw, "pitch": pitch, **ALWAYS}
        return {"hidden_contact": told}, {"hidden_contact": f.somewhere(x[1])}

    tried = tuple(f.weight * s for s in (-0.2, 0.1, 0.4, 1.0))
    return Law("hidden_contact", make, (tried, ALONG), (-3 * f.weight, 0.0), (3 * f.weight, 1.0))


def _tilt(f: Frame) -> Law:
    """Weight that pulls otherwise than was said: along the way it is said to, and along the body."""
    own = f.down if f.down.any() else f.axis

    def make(x):
        g = x[0] * own + x[1] * f.axis
        return {"gravity": {**dict(zip("xyz", map(float, g), strict=True)), "onset": -1.0}}, {}

    return Law("gravity", make, ((-2.0, 2.0), (-2.0, 2.0)), (-10.0, -10.0), (10.0, 10.0))


def _lump(f: Frame) -> Law:
    def make(x):
        return {"stiff_inclusion": {"s": x[0]}}, {"stiff_inclusion": f.somewhere(x[1])}

    return Law("stiff_inclusion", make, ((0.2, 4.0), ALONG), (0.06, 0.0), (16.0, 1.0))


def _part(f: Frame) -> Law:
    """Stiffer or softer from some place on to what is held; the base's modulus is then the one there."""

    def make(x):
        place = Place(f.along(x[1]), SEAM * f.length, tuple(map(float, f.axis)))
        return {"stiff_inclusion": {"s": x[0]}}, {"stiff_inclusion": place}

    return Law("stiff_inclusion", make, ((0.4, 2.5), (0.3, 0.5, 0.7)), (0.06, 0.1), (16.0, 0.95), divides=0)


def _stiffening(f: Frame) -> Law:
    tried = tuple(f.E * s for s in (0.1, 0.5))
    return Law("stiffening", lambda x: ({"stiffening": {"k": x[0]}}, {}), (tried,), (1e-4 * f.E,), (10 * f.E,))
