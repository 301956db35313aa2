"""What may have been left out: every law with the places, times and forms in which it is tried.

A block is a set of signatures (what the observed points would do); a hypothesis is a law at one place, time and form,
as a combination of a block's columns. Signatures come from the laws' own float64 forms along the base run, answered by
its tangent stiffness (tangent.py); for a law that neither remembers nor looks at the clock they are computed at the
tangent's states.
"""

from collections.abc import Callable, Iterator

import numpy as np

from surgisim.diagnosis import local, memory, whole
from surgisim.diagnosis.base import Base
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import Block, places
from surgisim.diagnosis.memo import Memo

Parts = Iterator[tuple[str, Callable[[], Iterator[Block]]]]
"""Names of parts, and what makes their blocks."""


def blocks(clip: Clip, base: Base, memo: Memo, only: np.ndarray | None = None) -> Parts:
    """All that is tried, one part after the other, each made when it is asked for.

    only: where alone local laws are tried [m], (3,); None for everywhere.
    """

    def centers(depth: float = 0.15) -> np.ndarray:
        found = places(clip, depth=depth)
        return found if only is None else found[[np.linalg.norm(found - only, axis=1).argmin()]]

    yield "laws of the whole body", lambda: iter([whole.everywhere(clip, base)])
    turns = np.arange(whole.ANGLES) * np.pi / whole.ANGLES
    yield "strands", lambda: iter([whole.strands(clip, base, turns, (0.2,))])
    yield "laws that remember", lambda: iter([memory.remembering(clip, base, memo=memo)])
    yield "weight", lambda: iter([whole.bulk(clip, base)])
    if clip.body.held.any():
        yield "breathing", lambda: iter([whole.breathing(clip, base)])
    if len(clip.motion.radius):
        yield "slipping grips", lambda: local.slipping(clip, base)
    for depth in (0.15, 0.45):
        yield "lumps", lambda d=depth: iter([local.lumps(clip, base, centers(d))])
    for center in centers():
        yield "pushes and bands", lambda c=center: iter([local.pushes(clip, base, c)])
    yield "contractions", lambda: whole.contracting(clip, base)


def costly(clip: Clip, base: Base, memo: Memo, workers: int) -> Parts:
    """What only runs of the engine can tell; tried where something is to be told."""
    if clip.body.held.any() and len(clip.motion.radius):
        yield "a gliding base", lambda: memory.gliding(clip, base, memo, workers)
