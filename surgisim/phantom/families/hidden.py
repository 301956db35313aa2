"""What may be hidden in a body of any family: its place, its time, and the numbers beside its magnitude, by chance.

`conceals` of a solver says which of these it implements. Names are those of truths and verdicts.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from surgisim.artifacts.character import Truly
from surgisim.phantom.families.world import World


@dataclass(frozen=True)
class Hidden:
    name: str
    magnitude: float = 0.0
    """What the search for an evidence scales; 0 hides nothing."""
    center: np.ndarray | None = None
    """Where [m], (3,); None where it is everywhere."""
    extent: float | None = None
    """Radius about the centre [m]."""
    onset: float | None = None
    """[s]"""
    end: float | None = None
    """[s]"""
    numbers: dict[str, float | list[float]] = field(default_factory=dict)

    def scaled(self, magnitude: float) -> "Hidden":
        return replace(self, magnitude=magnitude)

    def share(self, points: np.ndarray) -> np.ndarray:
        """How much of it acts at rest positions [m], (..., 3): falls like a bell with the distance; 1 if everywhere."""
        if self.center is None or self.extent is None:
            return np.ones(points.shape[:-1])
        away = np.linalg.norm(points - self.center, axis=-1) / self.extent
        return 1 / (1 + away**8)


@dataclass(frozen=True, kw_only=True)
class Kind:
    draw: Callable[[World, np.random.Generator, str], Hidden]
    start: float
    """A magnitude to begin the search with."""
    most: float
    """Beyond it no tissue bears it."""
    parameter: str
    """Name and unit of what the magnitude is, as the truth says it."""
    unit: str = "1"
    value: Callable[[World, Hidden], float | None] = lambda world, hidden: hidden.magnitude
    """The parameter at the hidden magnitude."""
    outside: bool = False
    """Not in the catalogue of what a diagnosis may name."""
    character: Truly | None = None
    """How it behaves, of what has no name."""


def everywhere(world, rng, name):
    return Hidden(name)


def _near_grip(world: World, rng: np.random.Generator, low: float, high: float, depth: tuple[float, float]):
    """A place inside [m] between two multiples of the first grip's radius from it, some share of the way inward."""
    grip, body = world.grips[0], world.body
    upper = np.unique(body.upper)
    away = np.linalg.norm(body.points[upper] - grip.center, axis=1) / grip.radius
    fits = upper[(away > low) & (away < high)]
    k = int(rng.choice(fits)) if len(fits) else int(upper[np.argmin(abs(away - 0.5 * (low + high)))])
    return body.points[k] - rng.uniform(*depth) * 0.7 * body.thickness * body.out[k], body.out[k]


def _in_phase(world: World, rng: np.random.Generator, low: float, high: float) -> float:
    """[s]; 0 the first grip closes, 1 it has arrived, 2 it lets go, 3 the end of what is fitted."""
    grip = world.grips[0]
    marks = [grip.begin / world.fps, grip.arrive / world.fps, grip.release / world.fps]
    return float(np.interp(rng.uniform(low, high), range(4), [*marks, max(world.end_of_fit, marks[2] + 0.1)]))


def _along(world: World, rng: np.random.Generator) -> list[float]:
    """A unit vector along the tissue near the first grip."""
    out = world.body.out[np.argmin(np.linalg.norm(world.body.points - world.grips[0].center, axis=1))]
    flat = np.cross(out, rng.standard_normal(3))
    return (flat / np.linalg.norm(flat)).tolist()


def _inclusion(world, rng, name):
    at, _ = _near_grip(world, rng, 0.9, 2.6, (0.2, 0.8))
    return Hidden(name, center=at, extent=float(np.clip(rng.uniform(0.3, 0.5) * world.body.thickness, 0.003, 0.009)))


def _tether(world, rng, name):
    at, out = _near_grip(world, rng, 1.1, 2.4, (0.0, 0.2))
    # From a place below, as an adhesion is.
    numbers = {"slack": rng.uniform(0.0, 8e-4), "foot": (at - rng.uniform(2e-3, 6e-3) * out).tolist()}
    return Hidden(name, center=at, extent=rng.uniform(0.003, 0.006), numbers=numbers)


def _fibre(world, rng, name):
    return Hidden(name, numbers={"direction": _along(world, rng)})


def _relaxation(world, rng, name):
    return Hidden(name, numbers={"tau": 0.25 * math.exp(rng.uniform(0, math.log(8)))})


def _slip(world, rng, name):
    grip = world.grips[0]
    begin, end = _in_phase(world, rng, 0.4, 1.5), grip.release / world.fps
    count = int(rng.integers(1, 4))
    return Hidden(
        name, center=grip.center, extent=grip.radius, onset=begin, end=end,
        numbers={"jerks": np.sort(rng.uniform(begin, max(end, begin + 0.05), count)).tolist()},
    )  # fmt: skip


def _contact(world, rng, name):
    at, out = _near_grip(world, rng, 1.6, 4.0, (0.0, 0.0))
    begin = _in_phase(world, rng, 0.0, 1.8)
    end = begin + rng.uniform(0.4, 1.3)
    push = -out + 0.5 * rng.standard_normal(3) * rng.uniform(0, 1)
    return Hidden(
        name, center=at, extent=rng.uniform(0.004, 0.007), onset=begin, end=end,
        numbers={"direction": (push / np.linalg.norm(push)).tolist(), "rise": rng.uniform(0.08, 0.3)},
    )  # fmt: skip


def _breath(world, rng, name):
    way = rng.standard_normal(3)
    numbers = {"frequency": rng.uniform(0.22, 0.7), "phase": rng.uniform(0, 2 * np.pi), "skew": rng.uniform(0, 0.5)}
    return Hidden(name, numbers={**numbers, "direction": (way / np.linalg.norm(way)).tolist()})


def _contraction(world, rng, name):
    local, travels = rng.uniform() < 0.5, rng.uniform() < 0.5
    at, _ = _near_grip(world, rng, 0.5, 4.0, (0.1, 0.6))
    numbers = {
        "period": rng.uniform(0.7, 2.4),
        "wavelength": rng.uniform(0.02, 0.07) if travels else 1e3,
        "direction": _along(world, rng),
    }
    onset = 0.0 if rng.uniform() < 0.4 else _in_phase(world, rng, 0.0, 1.8)
    place = {"center": at, "extent": rng.uniform(0.008, 0.014)} if local else {}
    return Hidden(name, onset=onset, numbers=numbers, **place)


def _swelling(world, rng, name):
    at, _ = _near_grip(world, rng, 0.5, 4.0, (0.1, 0.6))
    return Hidden(
        name, center=at, extent=rng.uniform(0.006, 0.011), onset=_in_phase(world, rng, 0.0, 1.5),
        numbers={"lasts": rng.uniform(0.5, 2.0)},
    )  # fmt: skip


def _second(world, rng, name):
    at, out = _near_grip(world, rng, 1.8, 4.5, (0.0, 0.0))
    along = np.cross(out, rng.standard_normal(3))
    way = 0.6 * out + along / np.linalg.norm(along)
    begin = _in_phase(world, rng, 0.2, 1.4)
    numbers = {"direction": (way / np.linalg.norm(way)).tolist(), "rate": rng.uniform(0.3, 0.8)}
    return Hidden(name, center=at, extent=rng.uniform(0.003, 0.006), onset=begin, numbers=numbers)


def _softening(world, rng, name):
    return Hidden(name, onset=_in_phase(world, rng, 0.2, 1.5), numbers={"lasts": rng.uniform(0.2, 1.0)})


KINDS: dict[str, Kind] = {
    "stiff_inclusion": Kind(
        draw=_inclusion, start=2.0, most=30.0, parameter="factor", value=lambda w, h: 1 + h.magnitude
    ),
    "tether": Kind(
        draw=_tether, start=2.0, most=60.0, parameter="k", unit="N/m",
        value=lambda w, h: h.magnitude * w.material.E * h.extent,
    ),
    "fibre": Kind(draw=_fibre, start=1.0, most=25.0, parameter="stiffness"),
    "stiffening": Kind(draw=everywhere, start=1.0, most=15.0, parameter="growth"),
    "relaxation": Kind(draw=_relaxation, start=0.4, most=3.0, parameter="g"),
    "plastic_set": Kind(draw=everywhere, start=6.0, most=60.0, parameter="inverse_yield"),
    "damage": Kind(draw=everywhere, start=4.0, most=40.0, parameter="inverse_bears"),
    "tool_slip": Kind(draw=_slip, start=0.25, most=0.85, parameter="slipped"),
    "hidden_contact": Kind(
        draw=_contact, start=0.3, most=4.0, parameter="force", unit="N",
        value=lambda w, h: h.magnitude * w.material.E * h.extent**2,
    ),
    "respiration": Kind(draw=_breath, start=4e-4, most=4e-3, parameter="amplitude", unit="m"),
    "active_contraction": Kind(
        draw=_contraction, start=0.1, most=0.8, parameter="tension", unit="Pa",
        value=lambda w, h: h.magnitude * w.material.E,
    ),
    "sliding_base": Kind(draw=everywhere, start=2.0, most=60.0, parameter="inverse_traction"),
    "swelling": Kind(
        draw=_swelling, start=0.1, most=0.6, parameter="growth", outside=True,
        character=Truly(at_rest=(True,), change=("grows",), energy=("gives",), local=(True,)),
    ),
    "second_grip": Kind(
        draw=_second, start=1.0, most=6.0, parameter="way", outside=True,
        character=Truly(at_rest=(True,), change=("grows",), energy=("gives",), local=(True,)),
    ),
    "softening": Kind(
        draw=_softening, start=0.2, most=0.7, parameter="lost", outside=True,
        # What a softer tissue stores less it loses where it is held: whose work that is is not asked.
        character=Truly(at_rest=(False,), local=(False,)),
    ),
}  # fmt: skip


def described(world: World, hidden: Hidden, own: bool) -> dict:
    """What the truth says of it, in the words of a diagnosis; own: its magnitude is its solver's alone."""
    kind = KINDS[hidden.name]
    numbers = {
        f"own {kind.parameter}" if own else kind.parameter: {"value": kind.value(world, hidden), "unit": kind.unit}
    }
    numbers |= {name: {"value": value, "unit": UNITS.get(name, "1")} for name, value in hidden.numbers.items()}
    here = None if hidden.center is None else hidden.center.tolist()
    return {
        "term": hidden.name,
        "outside_catalogue": kind.outside,
        "place": "everywhere" if here is None else {"center": here, "extent": hidden.extent, "unit": "m"},
        "time": {"onset": hidden.onset, "end": hidden.end},
        "parameters": numbers,
        "magnitude": hidden.magnitude,
    }


UNITS = {
    "tau": "s", "slack": "m", "foot": "m", "period": "s", "wavelength": "m", "frequency": "1/s", "phase": "rad",
    "rise": "s", "lasts": "s", "jerks": "s", "rate": "1/s",
}  # fmt: skip
