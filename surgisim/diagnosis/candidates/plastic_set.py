"""Tissue that was strained beyond its yield strain does not come back all the way."""

from collections.abc import Iterator, Sequence

import numpy as np

from surgisim.diagnosis import knobs, memories
from surgisim.diagnosis.base import values_on
from surgisim.diagnosis.candidate import Candidate, Parts
from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.law import Law, placed
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.memories import SMALL
from surgisim.diagnosis.scopes import EVERYWHERE, Where, all_of, around, here
from surgisim.diagnosis.stresses import block
from surgisim.diagnosis.tangent import base_piola
from surgisim.diagnosis.uncertain import scaled
from surgisim.physics.catalogue import choose

NAME = "plastic_set"
YIELDS = (0.05, 0.08, 0.12, 0.17, 0.24)
YIELDS_HERE = (0.08, 0.17)
"""Yield strains tried everywhere, and in some of the tissue."""


def law(h, amplitude, clip) -> Law:
    own = {"yield_strain": h.about["yield_strain"], "share": min(float(amplitude[0]), 1.0)}
    return Law({NAME: own}, placed(h, NAME))


def _block(look: Look, wheres: Sequence[Where], yields: Sequence[float]) -> Block:
    term, base, columns, found = choose([NAME])[NAME], look.base, [], []
    for yields_at in yields:
        row = {"yield_strain": float(yields_at), "share": SMALL}

        def stress(F, q, plain, row=row):
            flow = term.twin(q, **row)
            # First Piola against F of a stress that sees F G: J sigma(F G) F^-T.
            seen = base_piola(base.prepared, values_on(look.clip, base.x), F @ flow) @ np.swapaxes(flow, -1, -2)
            return (seen - plain) / SMALL

        columns.append(memories.followed(look, NAME, row, stress, wheres))
        found.append(row)
    return block(NAME, columns, wheres, 1, found)


def tried(look: Look) -> Parts:
    def make() -> Iterator[Block]:
        yield _block(look, all_of(look), YIELDS_HERE)
        yield _block(look, [EVERYWHERE], [y for y in YIELDS if y not in YIELDS_HERE])

    yield "lasting sets", make


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    yield _block(look, [here(h)], h.about["yield_strain"] * np.exp(0.4 * step * np.array([-0.5, 0.0, 0.5])))
    if h.place is not None:
        yield _block(look, around(look, h, step), (h.about["yield_strain"],))


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    finer=finer,
    knobs=lambda h, a: [*knobs.strength(h, a), *knobs.place(h), knobs.logarithm("yield_strain", 0.4)],
    interval=scaled("share"),
    seen="the tissue {where} does not come back all the way after the release",
    added="a lasting set ({amount})",
)
