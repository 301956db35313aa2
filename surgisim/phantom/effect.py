"""What a concealed effect is, and which there are.

An effect is one module in `effects/` holding one `EFFECT`; its file name is its name in truths and verdicts. None of
them shares a line with the engine's laws: each is written from its physics for this room's finite elements.
"""

import importlib
import math
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from surgisim.artifacts.character import Truly
from surgisim.phantom import effects
from surgisim.phantom.model import Model
from surgisim.phantom.scene import Scene
from surgisim.phantom.strains import blob


@dataclass(frozen=True)
class Hidden:
    """One concealed effect."""

    name: str
    magnitude: float = 0.0
    """What the search for a signal-to-noise ratio scales; 0 conceals nothing."""
    center: np.ndarray | None = None
    """Where [m], (3,); None where it is everywhere."""
    extent: float | None = None
    """Radius about the centre [m]."""
    onset: float | None = None
    """[s]; None where it acts from the beginning."""
    end: float | None = None
    """[s]"""
    numbers: dict[str, tuple[float | list[float], str]] = field(default_factory=dict)
    """The other parameters: value and unit."""

    def scaled(self, magnitude: float) -> "Hidden":
        return replace(self, magnitude=magnitude)

    def number(self, name: str) -> float:
        value = self.numbers[name][0]
        assert isinstance(value, float)
        return value

    def vector(self, name: str) -> np.ndarray:
        return np.array(self.numbers[name][0])

    def share(self, points: np.ndarray) -> np.ndarray:
        """How much of the effect acts at rest positions [m], (..., 3): 1 inside, 0 outside; 1 if everywhere."""
        if self.center is None or self.extent is None:
            return np.ones(points.shape[:-1])
        return blob(points, self.center, self.extent)


@dataclass(frozen=True, kw_only=True)
class Effect:
    draw: Callable[[Scene, np.random.Generator, str], Hidden]
    """Everything but the magnitude, by chance; the last argument is the effect's name."""
    apply: Callable[[Model, Hidden], Model]
    """The model with the effect; unchanged in every digit where the magnitude is 0."""
    parameter: str
    """Name of what the magnitude scales."""
    unit: str
    start: float
    """A magnitude to begin the search with."""
    most: float
    """Beyond it the effect is no tissue's, or the steps would have to be much smaller."""
    value: Callable[[Scene, Hidden], float] = lambda scene, hidden: hidden.magnitude
    """The parameter at the hidden magnitude, in `unit`."""
    outside: bool = False
    """Not in the catalogue of what a diagnosis may name."""
    character: Truly | None = None
    """Of what is outside: how a law without a name is rightly said to behave."""
    faint: bool = False
    """Cannot be seen at a magnitude that tissue has; not drawn unless asked for."""


def catalogue() -> dict[str, Effect]:
    """Every effect by name, in alphabetical order."""
    modules = pkgutil.iter_modules(effects.__path__, f"{effects.__name__}.")
    return {m.name.rpartition(".")[2]: importlib.import_module(m.name).EFFECT for m in modules}


def conceal(model: Model, hidden: tuple[Hidden, ...]) -> Model:
    """The model with all of them."""
    known = catalogue()
    for each in hidden:
        if each.magnitude != 0.0:
            model = known[each.name].apply(model, each)
    return model


def described(scene: Scene, hidden: Hidden) -> dict:
    """What the truth says of it, in the words of a diagnosis."""
    effect = catalogue()[hidden.name]
    numbers = {effect.parameter: (effect.value(scene, hidden), effect.unit), **hidden.numbers}
    here = None if hidden.center is None else hidden.center.tolist()
    return {
        "term": hidden.name,
        "outside_catalogue": effect.outside,
        "place": "everywhere" if here is None else {"center": here, "extent": hidden.extent, "unit": "m"},
        "time": {"onset": hidden.onset, "end": hidden.end},
        "parameters": {name: {"value": value, "unit": unit} for name, (value, unit) in numbers.items()},
        "magnitude": hidden.magnitude,
    }


def near_grip(
    scene: Scene, rng: np.random.Generator, distance: tuple[float, float], depth: tuple[float, float], rim: float = 4e-3
) -> np.ndarray:
    """A point [m], (3,), at a distance range [m] from the first grip along the tissue and a share of its depth."""
    shape, grip = scene.shape, scene.holds[0].grip
    while True:
        away, turn = rng.uniform(*distance), rng.uniform(0, 2 * np.pi)
        uv = grip.uv + away * np.array([math.cos(turn), math.sin(turn)])
        if (uv > shape.low + rim).all() and (uv < shape.high - rim).all():
            break
    top = -float(shape.relief(uv))
    return shape.place(np.append(uv, top + rng.uniform(*depth) * (shape.thickness - top)))


def along_tissue(scene: Scene, rng: np.random.Generator) -> list[float]:
    """A unit vector in the tissue's plane, (3,)."""
    turn = rng.uniform(0, 2 * np.pi)
    return (math.cos(turn) * scene.shape.axes[0] + math.sin(turn) * scene.shape.axes[1]).tolist()


def in_phase(scene: Scene, rng: np.random.Generator, low: float, high: float) -> float:
    """A time [s]: 0 the first grip closes, 1 the pull has arrived, 2 it is released, 3 the end of the fitted part."""
    hold = scene.holds[0]
    marks = [hold.begin / scene.fps, hold.arrive / scene.fps, hold.release / scene.fps, scene.end_of_fit]
    return float(np.interp(rng.uniform(low, high), range(4), marks))
