"""Something unseen pushes: it sets in at one moment, and lets go at another or stays.

Each point's constant is projected out, so a push that stays from 1.2 s on is, but for the first frames, the opposite
push up to then. A recording begins at rest: what pushes in its first frame is part of the rest shape. So of the two
only the one that is zero in the first frame is tried, and has the direction in which something pushed.
"""

from collections.abc import Iterator

import numpy as np

from surgisim.diagnosis import knobs, pushes
from surgisim.diagnosis.candidate import Candidate, Parts, stronger
from surgisim.diagnosis.form import Block, moments, spread
from surgisim.diagnosis.hypothesis import RISE, Hypothesis, ease
from surgisim.diagnosis.law import Law
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.uncertain import scaled
from surgisim.physics.place import Place

NAME = "hidden_contact"
LASTS = (0.3, 0.45, 0.6, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5)
"""How long a push is tried that lets go [s]."""


def law(h, amplitude, clip) -> Law:
    return Law({NAME: pushes.push(amplitude, h.onset, h.end)}, {NAME: h.place})


def course(at: np.ndarray, onset: float, end: float | None) -> np.ndarray:
    """Share of the push at some times [s]; end None: it stays."""
    begun = ease((at - onset) / RISE)
    return begun if end is None else begun * ease((end - at) / RISE)


def _block(look: Look, place: Place, tried: list[tuple[float, float | None]]) -> Block:
    at = pushes.times(look.clip)
    found = []
    for onset, end in tried:
        # Up to constants a push that lets go after the last frame is one that stays.
        inside = end is None or (onset < end <= at[-1])
        shape = course(at, onset, end)
        if onset >= RISE and inside and shape.any():
            found.append(Hypothesis(NAME, spread(shape), 0, place, onset, end, scope="blob"))
    return Block(pushes.columns(look, place), found)


def tried(look: Look) -> Parts:
    begins = moments(look.clip)
    steps = [(b, None) for b in begins] + [(b, b + lasts) for b in begins for lasts in LASTS]
    for part, place in pushes.places(look):
        yield part, lambda p=place: iter([_block(look, p, steps)])


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    begins = h.onset + step * pushes.SHIFTS
    ends = [None] if h.end is None else h.end + step * pushes.SHIFTS
    for place in pushes.around(look, h, step):
        yield _block(look, place, [(b, e) for b in begins for e in ends])


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    finer=finer,
    knobs=lambda h, a: [*knobs.amplitudes(h, a), *knobs.place(h), *knobs.moment(h, "onset", "end")],
    interval=scaled("force", over_stiffness=True),
    beside=stronger,
    seen="something unseen pushes the tissue {where} from {onset} to {end}",
    added="a push there ({amount})",
    presses=True,
    free_course=True,
)
