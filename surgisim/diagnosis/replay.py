"""Base, what is named and a placebo once more, on a finer grid.

The search runs on a coarse grid, where a thousand runs cost minutes. Its own error there is as large as an effect that
shows little in a second grasp, and may happen to hide it or to pass for it; what is shown is replayed with that error
smaller, with the same numbers.
"""

from dataclasses import dataclass, replace

import numpy as np

from surgisim.diagnosis.base import carried, simulate
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.joint import Joint
from surgisim.diagnosis.laws import IMPOSSIBLE, Clash, joined, law_of, respond
from surgisim.estimation.trial import at_once


@dataclass(frozen=True)
class Replay:
    """Displacement of the points over the whole clip [m], (K, T, 3)."""

    clip: Clip
    """With the grid of these runs."""
    before: np.ndarray
    after: np.ndarray
    placebo: np.ndarray | None


def replayed(case, named: Joint, placebo: Joint | None) -> Replay | None:
    """The three predictions of a `diagnose.Case`.

    None where the grid would not be finer, or where the engine breaks down on it.
    """
    share = case.settings.replay
    if share >= case.settings.grid:
        return None
    clip = case.clip.laid(share=share)
    memo = case.memo.on(share)

    def bare(x: np.ndarray) -> np.ndarray:
        prepared = clip.prepared(case.base.prepared.terms)
        _, run = simulate(prepared, clip, x, memo, clip.frames)
        return carried(prepared.simulator.carry(clip.rest), run)

    def moved(what: Joint) -> np.ndarray:
        base = replace(case.base, x=what.x)
        laws = [law_of(r.finding.hypothesis, r.amplitude, clip) for r in what.refits]
        try:
            return respond(clip, base, joined(laws), memo)
        except Clash:
            simulated = bare(what.x)
            return simulated + sum(respond(clip, base, law, memo) - simulated for law in laws)

    try:
        before, *after = at_once(
            lambda what, _: bare(case.base.x) if what is None else moved(what),
            [None, named, *([] if placebo is None else [placebo])],
            case.workers,
        )
    except IMPOSSIBLE:
        return None
    return Replay(clip, before, after[0], after[1] if placebo is not None else None)
