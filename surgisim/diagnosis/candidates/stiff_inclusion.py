"""A lump stiffer or softer than the tissue around it."""

from collections.abc import Iterator

from surgisim.diagnosis import knobs
from surgisim.diagnosis.candidate import Candidate, Parts
from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.inclusion import interval, law, stiffer
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.scopes import around, blobs

NAME = "stiff_inclusion"
DEPTHS = (0.15, 0.45)
"""Shares of the depth below the observed side at which lumps are tried."""


def tried(look: Look) -> Parts:
    yield "lumps", lambda: iter([stiffer(look, NAME, blobs(look, DEPTHS))])


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    yield stiffer(look, NAME, around(look, h, step))


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    finer=finer,
    knobs=lambda h, a: [*knobs.amplitudes(h, a), *knobs.place(h)],
    interval=interval,
    seen="the tissue {where} strains {less} than around it",
    added="a lump of another stiffness ({amount})",
)
