"""The weight of all tissue changes at one moment, as on a table that is tilted."""

from collections.abc import Iterator

import numpy as np

from surgisim.diagnosis import knobs, pushes
from surgisim.diagnosis.candidate import Candidate, Parts, stronger
from surgisim.diagnosis.form import Block, moments, spread
from surgisim.diagnosis.hypothesis import RISE, Hypothesis, ease
from surgisim.diagnosis.law import Law
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.uncertain import Spread
from surgisim.estimation.identify import NINETY

NAME = "gravity"


def law(h, amplitude, clip) -> Law:
    return Law({NAME: {**dict(zip("xyz", map(float, amplitude), strict=True)), "onset": h.onset + RISE / 2}}, {})


def _block(look: Look, begins: np.ndarray) -> Block:
    each = np.full(len(look.rest), look.clip.density)
    columns = look.once("weight", None, lambda: pushes.of_force(look, each))
    at = pushes.times(look.clip)
    found = [Hypothesis(NAME, spread(ease((at - b) / RISE)), 0, None, b) for b in begins if b >= 0]
    return Block(columns, [h for h in found if h.mix.any()])


def tried(look: Look) -> Parts:
    yield "weight", lambda: iter([_block(look, moments(look.clip))])


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    yield _block(look, h.onset + step * pushes.SHIFTS)


def interval(key: str, value: float, spread: Spread) -> tuple[float, float]:
    if key not in "xyz":
        return value, value
    reach = float(np.hypot(NINETY * spread.each["xyz".index(key)], spread.by_stiffness * abs(value)))
    return value - reach, value + reach


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    finer=finer,
    knobs=lambda h, a: [*knobs.amplitudes(h, a), *knobs.moment(h, "onset")],
    interval=interval,
    beside=stronger,
    seen="all tissue shifts one way from {onset} on, as on a tilted table",
    added="that change of weight ({amount})",
)
