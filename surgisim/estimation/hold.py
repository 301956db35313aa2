"""How a body is held: below and along its edge, along its edge alone, or in a piece that goes along with a grip."""

import itertools
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from surgisim.estimation.pieces import Piece
from surgisim.estimation.rim import Rim
from surgisim.estimation.rounds import HEATS, RIVALS, STEPPED, cost_until, last_driven, number, settle_pull
from surgisim.estimation.trial import Trial, at_once

MOVED = 0.9
"""Share of the misfit elsewhere below which a body is taken to be moved by what its edge is seen to do."""
ONE_PIECE, IN_PIECES = ("carried edge", "hung"), ("loose piece", "parted piece")
"""Other ways in which a body may be held, the plainer first."""
WORTH = dict.fromkeys(ONE_PIECE, 2.0) | dict.fromkeys(IN_PIECES, 1.25)
"""Times the misfit of the best of them, before the shape is fitted, beyond which it is not fitted to one; chosen. Of
six real clips and seven of family 281131 those that were taken began with at most 1.48 of it, none in pieces."""

Say = Callable[[float, float, str], None]


def ask_hold(
    trial: Trial, x: np.ndarray, begun: np.ndarray, rim: Rim | None, piece: Piece | None, phase: np.ndarray,
    history: list, say: Say,
) -> tuple[Trial, np.ndarray]:  # fmt: skip
    """The trial held as what is seen of its edge and of what goes along with the grip says, and x with a pull's shape
    fitted so, where that fits what is not seen at the edge far better; else both as they are.

    It is asked once the shape has been fitted without: what else is wrong of a body is seen at its edge as well. begun:
    where that fit began, for what cannot be simulated where it ended.
    """
    last = last_driven(trial, phase)
    if not last or not (rim or piece):
        return trial, x
    alone = _without(trial, rim) if rim else trial
    kinds = _kinds(alone, rim, piece)
    # What goes along may bear a firmer grip than what is held.
    grips = sorted({1.0, trial.grip})
    ways = {(name, grip): replace(one, grip=grip) for name, one in kinds.items() for grip in grips}
    costs_of = partial(at_once, partial(cost_until, last=last), workers=trial.workers)
    without, *along = costs_of([(one, x) for one in (alone, *ways.values())])
    begins = {way: (c, x) for way, c in zip(ways, along, strict=True)}
    broken = [way for way, c in zip(ways, along, strict=True) if not np.isfinite(c)]
    again = costs_of([(ways[way], begun) for way in broken])
    begins |= {way: (c, begun) for way, c in zip(broken, again, strict=True)}
    for (name, grip), (c, _) in begins.items():
        history.append({"round": "hold", "as": name, "grip": grip, "without": number(without), "cost": number(c)})
    least = min(c for c, _ in begins.values())
    if least >= without:
        return trial, x
    # The shape was fitted to a body that is held: another has to be fitted before they can be compared.
    shared: list[np.ndarray | None] = [None, None]

    def fitted(name: str, _: int = 0) -> tuple[str, tuple[float, Trial, np.ndarray], list]:
        rows: list = []
        grip = min(grips, key=lambda grip: begins[name, grip][0])
        begin, tries = begins[name, grip][1], []
        # Where the fit of the shape ended may lie on another side of a ridge than where another body's ends.
        for k, start in enumerate((begin, begun)[: 1 if begin is begun else 2]):
            best, there, jacobian = settle_pull([ways[name, grip]], start, phase, rows, say, shared[k], HEATS[0])
            shared[k] = jacobian if shared[k] is None else shared[k]
            tries.append((cost_until((best, there), last=last), best, there, jacobian))
        cost, best, there, jacobian = min(tries, key=lambda one: one[0])
        # It must be far better than the body as it is held in the end: what is worse after two steps is left.
        if cost <= RIVALS * without:
            best, there, _ = settle_pull([best], there, phase, rows, say, jacobian)
            cost = cost_until((best, there), last=last)
        rows.append({"round": "hold", "as": name, "without": number(without), "cost": number(cost)})
        return name, (cost, best, there), rows

    first, *others = [n for n in kinds if min(begins[n, grip][0] for grip in grips) <= WORTH[n] * least]
    found = [fitted(first), *at_once(fitted, others, max(1, trial.workers // STEPPED))]
    history += itertools.chain.from_iterable(rows for *_, rows in found)
    fits = {name: fit for name, fit, _ in found}
    chosen, least = (trial, x), without
    # A body in pieces has to be as much better again than one in a single piece.
    for names in (ONE_PIECE, IN_PIECES):
        cost, *best = min((fits[n] for n in names if n in fits), key=lambda fit: fit[0], default=(np.inf,))
        if cost < MOVED * least:
            chosen = tuple(best)
        least = min(least, cost)
    return chosen


def _without(trial: Trial, rim: Rim) -> Trial:
    """The trial without the points that say where the edge goes: they are no evidence that it does."""
    observation = rim.leaves(trial.observation, trial.motion)
    alone = replace(trial, observation=observation, laying=replace(trial.laying, observation=observation, kept={}))
    if not trial.error:
        return alone
    # A point that is left out says nothing of the simulation's own error either.
    size = np.where(observation.weight > 0, trial.error.size, 0.0)
    return replace(alone, error=replace(trial.error, size=size, kept={}))


def _kinds(alone: Trial, rim: Rim | None, piece: Piece | None) -> dict[str, Trial]:
    """Other ways in which a body may be held, by name."""
    kinds: dict[str, Trial] = {}
    if rim:
        kinds[ONE_PIECE[0]] = carried = replace(alone, motion=rim.carries(alone.motion))
        # What only its edge carries ends there: beyond it nothing would.
        kinds[ONE_PIECE[1]] = replace(carried, laying=replace(carried.laying.ending(0.0, False), base=False))
    if piece:
        # What goes along with a grip is carried by that alone.
        beside = replace(alone, motion=rim.beside(piece.middles).carries(alone.motion)) if rim else alone
        kinds[IN_PIECES[0]] = replace(beside, laying=beside.laying.parted(piece.loose, piece.walls[:0]))
        if len(piece.walls):
            kinds[IN_PIECES[1]] = replace(beside, laying=beside.laying.parted(piece.loose, piece.walls))
    return kinds
