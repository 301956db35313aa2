"""A resistance that fades while tissue is held, to shear or to changes of volume."""

from collections.abc import Iterator, Sequence

import numpy as np

from surgisim.diagnosis import knobs, memories
from surgisim.diagnosis.candidate import Candidate, Parts, stronger
from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.law import Law, placed
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.residual.strengths import each
from surgisim.diagnosis.scopes import Where, all_of, around, here
from surgisim.diagnosis.stresses import block
from surgisim.diagnosis.tangent import piola
from surgisim.physics.catalogue import choose

NAME = "residual_fading"
KINDS = ("shear", "bulk")
"""The number that a form has."""
TAUS = (0.15, 0.4, 1.0, 2.5)
"""Times in which it fades [s]."""


def law(h, amplitude, clip) -> Law:
    numbers = {kind: float(amplitude[0]) if kind == h.about["kind"] else 0.0 for kind in KINDS}
    return Law({NAME: {**numbers, "tau": float(h.about["tau"])}}, placed(h, NAME))


def _block(look: Look, wheres: Sequence[Where], kinds: Sequence[str], taus: Sequence[float]) -> Block:
    term, columns, found = choose([NAME])[NAME], [], []
    for kind in kinds:
        for tau in taus:
            row = {**{k: float(k == kind) for k in KINDS}, "tau": float(tau)}

            def stress(F, q, _, row=row):
                return piola(term, F, row, q)

            columns.append(memories.followed(look, NAME, row, stress, wheres, fades=True))
            found.append({"kind": kind, "tau": float(tau)})
    return block(NAME, columns, wheres, 1, found)


def tried(look: Look) -> Parts:
    yield "what fades", lambda: iter([_block(look, all_of(look), KINDS, TAUS)])


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    kinds = [h.about["kind"]]
    yield _block(look, [here(h)], kinds, h.about["tau"] * np.exp(0.7 * step * np.array([-0.5, 0.0, 0.5])))
    if h.place is not None:
        yield _block(look, around(look, h, step), kinds, [h.about["tau"]])


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    finer=finer,
    knobs=lambda h, a: [*knobs.strength(h, a), *knobs.place(h), knobs.logarithm("tau", 0.7)],
    interval=each(KINDS),
    beside=stronger,
    seen="tissue {where} gives way while held",
    added="a resistance that fades ({amount})",
)
