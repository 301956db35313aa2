"""Tissue of another stiffness, in a blob or a layer: what its effect says of how stiff it is."""

from collections.abc import Sequence

import numpy as np

from surgisim.diagnosis.base import values_on
from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.law import Law
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.scopes import Where
from surgisim.diagnosis.stresses import block, followed
from surgisim.diagnosis.tangent import base_piola
from surgisim.diagnosis.uncertain import Spread

TERM = "stiff_inclusion"
"""Of the engine, for either."""
SPHERE = 0.45
"""2 (4 - 5 nu) / 15 (1 - nu) near nu = .45."""
SOFTEST, STIFFEST = 0.06, 40.0


def law(h: Hypothesis, amplitude: np.ndarray, clip) -> Law:
    return Law({TERM: {"s": stiffness_of(float(amplitude[0]))}}, {TERM: h.place})


def stiffness_of(amplitude: float) -> float:
    """How stiff a lump is whose effect, to first order, would be that of s = 1 + amplitude.

    A stiff lump takes up ever less strain: amplitude = (s - 1) / (1 + b (s - 1)), with b of a sphere in tissue that
    hardly changes its volume (Eshelby 1957, section 4).
    """
    left = 1 - SPHERE * amplitude
    s = 1 + amplitude / left if left > 0 else STIFFEST
    return float(np.clip(s, SOFTEST, STIFFEST))


def stiffer(look: Look, name: str, wheres: Sequence[Where]) -> Block:
    """The tissue's own stress once more, at each of the places."""
    prepared, values = look.base.prepared, values_on(look.clip, look.base.x)
    return block(name, [followed(look, lambda F: base_piola(prepared, values, F), wheres)], wheres, 0, [{}])


def interval(key: str, value: float, spread: Spread) -> tuple[float, float]:
    a = float(spread.amplitude[0])
    low, high = (stiffness_of(a * (1 + side * spread.share)) for side in (-1, 1))
    return min(low, high), max(low, high)
