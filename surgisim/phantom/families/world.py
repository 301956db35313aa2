"""Everything of a recording but what is hidden, drawn by chance: each part from a generator of its own."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from surgisim.phantom.families.bodies import KINDS, SUPPORTS, Body
from surgisim.phantom.families.bodies import draw as draw_body
from surgisim.phantom.timeline import ease

HANDLING = ("carried", "springs", "pads")
"""How a grip takes tissue along: its points as one; by springs; its rim less than its middle."""
COURSES = ("straight", "steps", "arc", "back")
"""Of a pull: there at once, in two steps, round an arc, or half the way back before it is held."""
Draw = Callable[[str], np.random.Generator]
"""A generator for one part of one case."""


@dataclass(frozen=True)
class Material:
    E: float
    """Young's modulus [Pa]."""
    nu: float
    """Poisson's ratio [1]."""
    eta: float
    """Viscosity [Pa s]."""
    density: float
    """[kg/m^3]"""

    @property
    def mu(self) -> float:
        """Shear modulus [Pa]."""
        return self.E / (2 * (1 + self.nu))

    @property
    def bulk(self) -> float:
        """Bulk modulus [Pa]."""
        return self.E / (3 * (1 - 2 * self.nu))


@dataclass(frozen=True)
class Grip:
    center: np.ndarray
    """At rest [m], (3,)."""
    radius: float
    """[m]"""
    pull: np.ndarray
    """How far it goes [m], (3,)."""
    aside: np.ndarray
    """How far an arc leaves the straight way [m], (3,)."""
    course: str
    handling: str
    begin: int
    """First frame in which it holds."""
    arrive: int
    """Frame in which the pull has arrived."""
    release: int
    """Last frame in which it holds."""
    early: float
    """How long before `begin` it closes, share of a frame [1]."""
    late: float
    """How long after `release` it opens, share of a frame [1]."""

    def path(self, frame: np.ndarray) -> np.ndarray:
        """Displacement [m], (..., 3), at times in frames."""
        s = np.clip((np.asarray(frame, float) - self.begin) / (self.arrive - self.begin), 0, 1)[..., None]
        if self.course == "steps":
            way = 0.5 * (ease(2.4 * s) + ease(2.4 * (s - 1 / 1.7)))
        elif self.course == "back":
            way = ease(1.6 * s) - 0.45 * ease(2.6 * (s - 1 / 1.6))
        else:
            way = ease(s)
        bow = np.sin(np.pi * way) if self.course == "arc" else 0.0 * s
        return way * self.pull + bow * self.aside

    def holds(self, frame: float) -> bool:
        return self.begin - self.early < frame <= self.release + self.late


@dataclass(frozen=True)
class World:
    body: Body
    material: Material
    grips: tuple[Grip, ...]
    fps: float
    frames: int
    split: int
    """First frame that is held out."""
    gravity: np.ndarray | None
    """In balance with the body at rest [m/s^2], (3,); None where the recording does not say."""
    probes: np.ndarray
    """Tracked points: number of a triangle of the body's upper side, (K,)."""
    weights: np.ndarray
    """Of the triangle's corners, (K, 3)."""

    @property
    def rest(self) -> np.ndarray:
        """Where the tracked points sit [m], (K, 3)."""
        corners = self.body.points[self.body.upper[self.probes]]
        return np.einsum("kc,kci->ki", self.weights, corners)

    @property
    def end_of_fit(self) -> float:
        """[s]"""
        return self.split / self.fps

    def pulled(self, share: float) -> "World":
        """The same with pulls of this share of their length."""
        return replace(self, grips=tuple(replace(g, pull=share * g.pull, aside=share * g.aside) for g in self.grips))

    def gripped(
        self, wider: float = 1.0, later: float = 0.0, sooner: float = 0.0, handling: str | None = None
    ) -> "World":
        """The same with grips this many times as wide, which open later and close sooner by these shares of a frame,
        and take tissue along in another way, one of HANDLING."""

        def other(g: Grip) -> Grip:
            how = handling or g.handling
            return replace(g, radius=wider * g.radius, late=g.late + later, early=g.early + sooner, handling=how)

        return replace(self, grips=tuple(map(other, self.grips)))

    def of_material(self, material: Material) -> "World":
        return replace(self, material=material)


def draw(draw_for: Draw, most_E: float = 3e4) -> World:
    """A slab, mound, flap or tube of .8 kPa to `most_E` [Pa], pulled one to three times, at 10-60 frames a second."""
    rng = draw_for("body")
    kind = str(rng.choice(KINDS))
    body = draw_body(rng, kind, str(rng.choice(SUPPORTS[kind])), 1 / rng.uniform(2.0, 3.4))
    rng = draw_for("material")
    E = 800.0 * math.exp(rng.uniform(0, math.log(most_E / 800.0)))
    lag = 2e-3 * math.exp(rng.uniform(0, math.log(15)))
    # A flap that hardly resists swings for minutes unless its viscosity is a tissue's.
    lag = max(lag, 0.012) if kind == "flap" else lag
    material = Material(E, rng.uniform(0.38, 0.475), E * lag, rng.uniform(950.0, 1120.0))
    fps, frames, split, timed = _timed(draw_for("times"))
    grips = _grips(draw_for("grips"), body, timed)
    rng = draw_for("gravity")
    down = -body.out[np.flatnonzero(body.out.any(1))].mean(0)
    down = down / max(np.linalg.norm(down), 1e-9) + 0.4 * rng.standard_normal(3)
    gravity = None if rng.uniform() < 0.2 else 9.81 * down / np.linalg.norm(down)
    probes, weights = _probes(draw_for("probes"), body)
    return World(body, material, grips, fps, frames, split, gravity, probes, weights)


def _timed(rng: np.random.Generator):
    """Frames a second, frames, the first held out, and (begin, arrive, release) of every grip."""
    fps = round(10 * math.exp(rng.uniform(0, math.log(6))), 2)
    rest = 0.0 if rng.uniform() < 0.12 else rng.uniform(0.15, 2.0)
    pulls = int(rng.choice([1, 2, 3], p=[0.15, 0.6, 0.25]))
    spans = [(rng.uniform(0.4, 1.1), rng.uniform(0.5, 2.0), rng.uniform(0.4, 1.4)) for _ in range(pulls)]
    now, timed = rest, []
    for load, hold, free in spans:
        begin = round(now * fps)
        arrive = begin + max(round(load * fps), 4)
        release = arrive + max(round(hold * fps), 3)
        timed.append((begin, arrive, release))
        now = release / fps + free
    frames = round(now * fps) + 1
    begin, arrive, release = timed[-1]
    # One pull alone: what comes after some of its hold is held out.
    split = max(begin - round(0.15 * fps), 1) if pulls > 1 else release - (release - arrive) // 3
    return fps, frames, split, timed


def _grips(rng: np.random.Generator, body: Body, timed) -> tuple[Grip, ...]:
    handling = str(rng.choice(HANDLING))
    early, late = rng.uniform(0, 1, 2) * (rng.uniform() < 0.7)
    free = [k for k in np.unique(body.upper) if not body.held[k]]
    spare = np.linalg.norm(body.points[free][:, None] - body.points[body.held][None], axis=-1).min(1)
    size = float(np.ptp(body.points, axis=0).max())
    grips: list[Grip] = []
    for begin, arrive, release in timed:
        radius = float(np.clip(rng.uniform(0.35, 0.7) * body.thickness, 0.0035, 0.0075))
        room = spare > min(1.4 * radius, 0.8 * spare.max())
        k = int(rng.choice(np.array(free)[room]))
        turn, lift = rng.uniform(0, 2 * np.pi), rng.uniform(0.3, 1.2)
        out = body.out[k]
        along = np.cross(out, rng.standard_normal(3))
        along /= np.linalg.norm(along)
        across = np.cross(out, along)
        length = float(np.clip(rng.uniform(0.25, 0.6) * body.thickness, 0.003, 0.012))
        length = length if body.kind in ("slab", "mound") else float(rng.uniform(0.08, 0.16) * size)
        flat = math.cos(turn) * along + math.sin(turn) * across
        pull = length * (math.sin(lift) * out + math.cos(lift) * flat)
        aside = 0.35 * length * rng.uniform(-1, 1) * np.cross(out, flat)
        course = str(rng.choice(COURSES))
        grips.append(Grip(body.points[k], radius, pull, aside, course, handling, begin, arrive, release, early, late))
    return tuple(grips)


def _probes(rng: np.random.Generator, body: Body) -> tuple[np.ndarray, np.ndarray]:
    """30-500 points of the upper side, evenly over its area, not where it is held."""
    count = round(30 * math.exp(rng.uniform(0, math.log(500 / 30))))
    a, b, c = np.moveaxis(body.points[body.upper], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) * ~body.held[body.upper].all(1)
    chosen = rng.choice(len(area), count, p=area / area.sum())
    weights = rng.dirichlet(np.ones(3), count)
    return chosen, weights
