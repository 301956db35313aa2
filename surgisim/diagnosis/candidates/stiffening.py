"""Tissue that resists the more the further it is strained, all of it or some."""

from collections.abc import Iterator

from surgisim.diagnosis import knobs
from surgisim.diagnosis.candidate import Candidate, Parts, stronger
from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.law import Law, placed
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.scopes import Where, all_of, around
from surgisim.diagnosis.stresses import block, followed
from surgisim.diagnosis.tangent import piola
from surgisim.diagnosis.uncertain import scaled
from surgisim.physics.catalogue import choose

NAME = "stiffening"


def law(h, amplitude, clip) -> Law:
    return Law({NAME: {"k": float(amplitude[0])}}, placed(h, NAME))


def _block(look: Look, wheres: list[Where]) -> Block:
    term = choose([NAME])[NAME]
    return block(NAME, [followed(look, lambda F: piola(term, F, {"k": 1.0}), wheres)], wheres, 1, [{}])


def tried(look: Look) -> Parts:
    yield NAME, lambda: iter([_block(look, all_of(look))])


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    if h.place is not None:
        yield _block(look, around(look, h, step))


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    finer=finer,
    knobs=lambda h, a: [*knobs.strength(h, a), *knobs.place(h)],
    interval=scaled("k", over_stiffness=True),
    beside=stronger,
    seen="the tissue {where} resists the more the further it is strained",
    added="strain stiffening ({amount})",
)
