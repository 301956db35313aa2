"""Part of the resistance to shear fades while tissue is held, and creeps back after its release."""

from collections.abc import Iterator, Sequence

import numpy as np

from surgisim.diagnosis import knobs, memories
from surgisim.diagnosis.candidate import Candidate, Parts, stronger
from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.law import Law, placed
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.scopes import EVERYWHERE, Where, all_of, around, here
from surgisim.diagnosis.stresses import block
from surgisim.diagnosis.tangent import piola
from surgisim.diagnosis.uncertain import scaled
from surgisim.physics.catalogue import choose

NAME = "relaxation"
TAUS = (0.1, 0.2, 0.4, 0.8, 1.6, 3.2)
TAUS_HERE = (0.2, 0.8, 3.2)
"""Relaxation times tried everywhere, and in some of the tissue [s]."""


def law(h, amplitude, clip) -> Law:
    return Law({NAME: {"G": float(amplitude[0]), "tau": h.about["tau"]}}, placed(h, NAME))


def _block(look: Look, wheres: Sequence[Where], taus: Sequence[float]) -> Block:
    term, columns, found = choose([NAME])[NAME], [], []
    for tau in taus:
        row = {"G": 1.0, "tau": float(tau)}

        def stress(F, q, _, row=row):
            return piola(term, F, row, q)

        columns.append(memories.followed(look, NAME, row, stress, wheres, fades=True))
        found.append(row)
    return block(NAME, columns, wheres, 1, found)


def tried(look: Look) -> Parts:
    def make() -> Iterator[Block]:
        yield _block(look, all_of(look), TAUS_HERE)
        yield _block(look, [EVERYWHERE], [tau for tau in TAUS if tau not in TAUS_HERE])

    yield "relaxation", make


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    yield _block(look, [here(h)], h.about["tau"] * np.exp(0.7 * step * np.array([-0.5, 0.0, 0.5])))
    if h.place is not None:
        yield _block(look, around(look, h, step), (h.about["tau"],))


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    finer=finer,
    knobs=lambda h, a: [*knobs.strength(h, a), *knobs.place(h), knobs.logarithm("tau", 0.7)],
    interval=scaled("G", over_stiffness=True),
    beside=stronger,
    seen="tissue {where} gives way while held and creeps back after the release",
    added="stiffness that fades ({amount})",
)
