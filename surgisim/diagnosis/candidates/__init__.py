"""What may have been left out: every law with the places, times and forms in which it is tried.

A law is one module here holding one `CANDIDATE`; its file name is its name in verdicts. Nothing is registered anywhere
else: the folder is the catalogue.

A block is a set of signatures (what the observed points would do); a hypothesis is a law at one place, time and form,
as a combination of a block's columns. Signatures come from the laws' own float64 forms along the base run, answered by
its tangent stiffness (tangent.py); for a law that neither remembers nor looks at the clock they are computed at the
tangent's states.
"""

import importlib
import pkgutil
from collections.abc import Callable, Collection, Iterator
from functools import cache

import numpy as np

from surgisim.diagnosis.base import Base
from surgisim.diagnosis.candidate import Candidate, Parts
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.residual import forms


@cache
def catalogue() -> dict[str, Candidate]:
    """Every law by name."""
    modules = pkgutil.iter_modules(__path__, f"{__name__}.")
    return {m.name.rpartition(".")[2]: importlib.import_module(m.name).CANDIDATE for m in modules}


def of(h: Hypothesis) -> Candidate:
    """The law that a hypothesis is about, which may be one without a name."""
    return catalogue().get(h.term) or forms.catalogue()[h.term]


def blocks(clip: Clip, base: Base, memo: Memo, only: np.ndarray | None = None) -> Parts:
    """All that is tried, one part after the other, each made when it is asked for.

    only: where alone local laws are tried [m], (3,); None for everywhere.
    """
    look = Look(clip, base, memo, only)
    return _parts(look, [c.tried for c in catalogue().values()])


def of_law(term: str, clip: Clip, base: Base, memo: Memo) -> Parts:
    """All that is tried of one law and is cheap."""
    return _parts(Look(clip, base, memo), [catalogue()[term].tried])


def without_a_name(look: Look, left_out: Collection[str] = ()) -> Parts:
    """All that is tried of the forms of a residual law, but for those left out."""
    return _parts(look, [c.tried for name, c in forms.catalogue().items() if name not in left_out])


def costly(clip: Clip, base: Base, memo: Memo, workers: int) -> Parts:
    """What only runs of the engine can tell; tried where something is to be told."""
    look = Look(clip, base, memo, workers=workers)
    return _parts(look, [c.costly for c in catalogue().values()])


def finer(clip: Clip, base: Base, h: Hypothesis, step: float = 1.0) -> Iterator[Block]:
    """Blocks around a hypothesis; `step` is a share of the coarse search's spacing."""
    return of(h).finer(Look(clip, base), h, step)


def _parts(look: Look, laws: list[Callable[[Look], Parts]]) -> Parts:
    named: dict[str, list[Callable[[], Iterator[Block]]]] = {}
    for tried in laws:
        for part, make in tried(look):
            named.setdefault(part, []).append(make)
    for part, makers in named.items():
        yield part, makers[0] if len(makers) == 1 else lambda m=makers: _joined(m)


def _joined(makers: list[Callable[[], Iterator[Block]]]) -> Iterator[Block]:
    """Blocks of several laws, those with the very same columns as one: columns are whitened only once."""
    found: dict[int, Block] = {}
    for make in makers:
        for block in make():
            known = found.get(id(block.columns))
            mine = block.hypotheses if known is None else known.hypotheses + block.hypotheses
            found[id(block.columns)] = Block(block.columns, mine)
    yield from found.values()
