"""Tissue that was strained too far is softer from then on."""

from collections.abc import Iterator, Sequence

import numpy as np

from surgisim.diagnosis import knobs, memories
from surgisim.diagnosis.candidate import Candidate, Parts
from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.law import Law, placed
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.memories import SMALL
from surgisim.diagnosis.scopes import EVERYWHERE, Where, all_of, around, here
from surgisim.diagnosis.stresses import block
from surgisim.diagnosis.uncertain import scaled
from surgisim.physics.catalogue import choose

NAME = "damage"
TEARS = (0.05, 0.08, 0.12, 0.17, 0.24)
TEARS_HERE = (0.08, 0.17)
"""Strains from which damage begins, tried everywhere and in some of the tissue."""
MOST = 0.8
"""Damage that is never exceeded, where a fit begins."""


def law(h, amplitude, clip) -> Law:
    own = {"onset": h.about["onset"], "rate": float(amplitude[0]), "most": h.about["most"]}
    return Law({NAME: own}, placed(h, NAME))


def _block(look: Look, wheres: Sequence[Where], tears: Sequence[float], most: float = MOST) -> Block:
    term, columns, found = choose([NAME])[NAME], [], []
    for onset in tears:
        row = {"onset": float(onset), "rate": SMALL, "most": most}

        def stress(F, q, plain, row=row):
            return (term.twin(F, q, **row) - 1)[:, None, None] / SMALL * plain

        columns.append(memories.followed(look, NAME, row, stress, wheres))
        found.append(row)
    return block(NAME, columns, wheres, 1, found)


def tried(look: Look) -> Parts:
    def make() -> Iterator[Block]:
        yield _block(look, all_of(look), TEARS_HERE)
        yield _block(look, [EVERYWHERE], [t for t in TEARS if t not in TEARS_HERE])

    yield "damage", make


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    onset, most = h.about["onset"], h.about["most"]
    yield _block(look, [here(h)], onset * np.exp(0.4 * step * np.array([-0.5, 0.0, 0.5])), most)
    if h.place is not None:
        yield _block(look, around(look, h, step), (onset,), most)


def turned(h: Hypothesis, amplitude: np.ndarray) -> list[knobs.Knob]:
    # The rate is what the amplitude scales.
    free = [knobs.logarithm("onset", 0.6), knobs.logarithm("most", 0.5, most=1.0)]
    return [*knobs.strength(h, amplitude), *knobs.place(h), *free]


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    finer=finer,
    knobs=turned,
    interval=scaled("rate"),
    seen="the tissue {where} is softer after it has been strained than before",
    added="damage ({amount})",
)
