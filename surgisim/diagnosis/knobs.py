"""What may be turned in a fit with everything about a law free, and how far it may be off."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import APART, scale
from surgisim.diagnosis.hypothesis import Hypothesis

Start = tuple[Hypothesis, np.ndarray]
"""A hypothesis and its amplitude, (H,)."""

EXTENT, MOMENT, TURN = 0.5, 0.12, 0.25
"""How far an extent (logarithm), a moment [s] and a direction [rad] may be off."""


@dataclass(frozen=True)
class Knob:
    turn: Callable[[Hypothesis, np.ndarray, float, Clip], Start]
    """Hypothesis and amplitude turned by some prior standard deviations."""


def turned(h: Hypothesis, amplitude: np.ndarray, knobs: Sequence[Knob], x: np.ndarray, clip: Clip) -> Start:
    """The hypothesis and its amplitude with every knob turned by x standard deviations."""
    amplitude = amplitude.astype(float)
    for knob, by in zip(knobs, x, strict=True):
        h, amplitude = knob.turn(h, amplitude, float(by), clip)
    return h, amplitude


def strength(h: Hypothesis, amplitude: np.ndarray) -> list[Knob]:
    """One factor on all amplitudes, which keeps their sign and direction."""
    return [Knob(lambda h, a, by, clip: (h, a * np.exp(by)))]


def amplitudes(h: Hypothesis, amplitude: np.ndarray) -> list[Knob]:
    """Each by itself."""
    size = float(np.linalg.norm(amplitude)) or 1.0

    def knob(k: int) -> Knob:
        return Knob(lambda h, a, by, clip: (h, a + by * size * np.eye(len(a))[k]))

    return [knob(k) for k in range(len(amplitude))]


def place(h: Hypothesis) -> list[Knob]:
    """Centre and extent of a blob, depth of a layer; nothing of what acts everywhere."""
    if h.place is None:
        return []
    if h.place.normal is not None:
        return [_moved(lambda clip: clip.normal)]
    return [*(_moved(lambda clip, e=e: np.eye(3)[e]) for e in range(3)), Knob(_widened)]


def _moved(way: Callable[[Clip], np.ndarray]) -> Knob:
    def turn(h, a, by, clip):
        center = np.asarray(h.place.center) + by * 0.5 * APART * scale(clip) * way(clip)
        return replace(h, place=replace(h.place, center=tuple(center))), a

    return Knob(turn)


def _widened(h: Hypothesis, a: np.ndarray, by: float, clip: Clip) -> Start:
    return replace(h, place=replace(h.place, extent=h.place.extent * float(np.exp(EXTENT * by)))), a


def moment(h: Hypothesis, *names: str) -> list[Knob]:
    """Onset or end, where there is one; never before the first frame."""

    def knob(name: str) -> Knob:
        return Knob(lambda h, a, by, clip: (replace(h, **{name: max(getattr(h, name) + MOMENT * by, 0.0)}), a))

    return [knob(name) for name in names if getattr(h, name) is not None]


def logarithm(key: str, reach: float, most: float = np.inf) -> Knob:
    """A positive number of the form, by its logarithm."""
    return about(key, lambda value, by: min(value * float(np.exp(reach * by)), most))


def plus(key: str, reach: float, low: float = -np.inf, high: float = np.inf) -> Knob:
    """A number of the form, between two ends."""
    return about(key, lambda value, by: float(np.clip(value + reach * by, low, high)))


def about(key: str, turned: Callable[[float, float], float]) -> Knob:
    """A number of the form."""
    return Knob(lambda h, a, by, clip: (replace(h, about={**h.about, key: turned(h.about[key], by)}), a))


def turn(key: str) -> Knob:
    """A direction of the form, about the observed side's normal."""

    def turned(h, a, by, clip):
        axis, n = np.asarray(h.about[key]), clip.normal
        axis = np.cos(TURN * by) * axis + np.sin(TURN * by) * np.cross(n, axis)
        return replace(h, about={**h.about, key: axis}), a

    return Knob(turned)
