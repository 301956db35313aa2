"""Base and named laws predicted together: with a law in place, the base no longer has to make up for it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from surgisim.diagnosis import calibration
from surgisim.diagnosis.base import Base, bounded, carried, simulate
from surgisim.diagnosis.laws import IMPOSSIBLE, Clash, joined, law_of, respond
from surgisim.diagnosis.refine import refined


@dataclass(frozen=True)
class Joint:
    refits: list
    """Best first, with the numbers that they have beside one another; a response stays that of its law alone."""
    moved: np.ndarray
    """Displacement of the points with all of them over the whole clip [m], (K, T, 3)."""
    gain: float
    """Of chi square over the base alone."""
    x: np.ndarray
    """The base that goes with them, and its moments of release, (3 + R,)."""
    beside: "Joint | None" = None
    """What else was fitted: one law instead of two, or the other way round."""


def based(case, x: np.ndarray) -> Base:
    """The base with other numbers, (3 + R,), run anew. Raises what IMPOSSIBLE names."""
    clip, base = case.clip, case.base
    drive, run = simulate(base.prepared, clip, x, case.memo, clip.frames)
    simulated = carried(base.prepared.simulator.carry(clip.rest), run)
    return replace(base, x=x, drive=drive, run=run, simulated=simulated)


def prediction(case, refits: list, moved: np.ndarray, x: np.ndarray | None) -> Joint:
    """With its gain; x None where the base stays."""
    until = case.clip.until
    left = case.z - case.whiten(moved[:, :until] - case.base.simulated[:, :until])
    both = np.stack([case.z, left], 1)
    before, after = np.diag(case.space.gram(both, both))
    return Joint(refits, moved, float(before - after), case.base.x if x is None else x)


def fit_jointly(case, refits: list, say: Callable[[str], None], *, free: bool) -> Joint:
    """One law as it was fitted; two fitted anew with all numbers of both and the base free, where `free`.

    Where that cannot be, because both need the same term, the base moves to where the metric puts it once the laws'
    responses are taken off, and the engine runs again. What gains no more than base and responses as they are, added,
    is not taken: chi square counts nuisances at their price, where a plain misfit takes what they do for the laws'.
    """
    plain = prediction(case, refits, case.base.simulated + sum(r.response for r in refits), refits[0].x)
    if len(refits) == 1 and refits[0].x is not None:
        # Law and base were fitted in the same runs.
        return plain
    tried = [plain, *(_freed(case, refits, say) if free and len(refits) > 1 else [])]
    if len(tried) == 1:
        tried += _moved(case, refits)
    return max(tried, key=lambda t: t.gain)


def needed(case, both: Joint) -> Joint:
    """Two laws fitted together, or one of them alone where the other says nothing beside it.

    The one found first may have stood for the other: beside it, it comes out as next to nothing. The law that stays
    keeps its numbers and the base, so that what goes is said to gain no less than it does. A law goes where that is no
    more than a second law must gain to be named.
    """
    best = max((one for r in both.refits for one in _alone(case, both, r)), key=lambda t: t.gain, default=None)
    if best is None or 0.5 * (both.gain - best.gain) > least(best):
        return both
    return best


def least(one: Joint) -> float:
    """Half the chi square that a law must take off beside `one`, whose signature's error must not pass for it."""
    return calibration.ADDS + calibration.FITTED_MISFIT * one.gain


def _alone(case, both: Joint, kept) -> list[Joint]:
    """One of two laws with the numbers and the base that it has beside the other; none where the engine breaks down."""
    try:
        moved = respond(
            case.clip,
            replace(case.base, x=both.x),
            law_of(kept.finding.hypothesis, kept.amplitude, case.clip),
            case.memo,
        )
    except IMPOSSIBLE:
        return []
    found = prediction(case, [kept], moved, both.x)
    mine = replace(kept, response=moved - case.base.simulated, gain=found.gain, x=both.x)
    return [replace(found, refits=[mine])]


def _freed(case, refits: list, say) -> list[Joint]:
    starts = [(r.finding.hypothesis, r.amplitude) for r in refits]
    try:
        joined([law_of(*start, case.clip) for start in starts])
    except Clash:
        return []
    bases = [] if refits[0].x is None else [refits[0].x]
    found = refined(case, case.z, starts, sum(r.response for r in refits), say, bases, refits[0].begun)
    if found is None:
        return []
    mine = [
        replace(
            r,
            finding=replace(r.finding, hypothesis=h),
            amplitude=amplitude,
            x=found.x,
            known=found.known,
            draws=tuple(draws),
        )
        for r, (h, amplitude), draws in zip(refits, found.laws, found.draws, strict=True)
    ]
    return [prediction(case, mine, case.base.simulated + found.response, found.x)]


def _moved(case, refits: list) -> list[Joint]:
    clip, base, until, first = case.clip, case.base, case.clip.until, refits[0].x
    left = case.z - sum(case.whiten(r.response[:, :until]) for r in refits)
    likely = case.space.likely(left)[case.slopes]
    x = base.x if first is None else first
    x = np.concatenate([bounded(x[:3] + likely * clip.prior.spread, clip), x[3:]])
    try:
        moved = based(case, x)
        simulated = moved.simulated
        laws = [law_of(r.finding.hypothesis, r.amplitude, clip) for r in refits]
        both = simulated + sum(respond(clip, moved, law, case.memo) - simulated for law in laws)
    except IMPOSSIBLE:
        return []
    return [prediction(case, refits, both, x)]
