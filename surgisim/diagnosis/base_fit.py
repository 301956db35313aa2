"""The base's fit, together with the nuisances, before anything is called missing.

Stiffness does not matter where tissue is driven by displacements and comes to rest between frames; it is told,
with the viscosity, by what a release looks like. So Poisson's ratio is searched through the tangent stiffness of the
last run, E and eta through short runs that begin just before the first release (`ring_down.py`); where nothing is
released, through whole runs.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from surgisim.diagnosis import calibration
from surgisim.diagnosis.base import (
    SPREAD,
    START,
    TERMS,
    Base,
    Known,
    at_bound,
    bounded,
    by_place,
    carried,
    simulate,
    values_of,
)
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.metric import Metric, metric
from surgisim.diagnosis.noise import Whitener
from surgisim.diagnosis.ring_down import ASIDE, DRAWS, Descent, RingDown, aside, softest, told
from surgisim.diagnosis.tangent import Tangent, base_piola, tangent
from surgisim.mpm.setup import Prepared
from surgisim.mpm.simulator import Breakdown

ROUNDS, AGAIN = 3, 25.0
"""Fits at most, and what chi square a run may cost beyond what the last one promised; chosen: 3 where it went well."""
NEWTONS, SETTLED = 2, 0.1
"""Steps at most by which grips, held tissue and elastic law, once they are known, move the base, and what counts as
none, in prior standard deviations."""
STIFFER = np.log(3.0)
"""Step of log E where the body to begin with is torn apart."""

Nuisances = Callable[[Clip, np.ndarray, np.ndarray, np.ndarray, bool], np.ndarray]
"""Of a clip, a base's numbers (3,), its tracks [m], (K, T, 3), their derivative by where points sit [1], (3, K, T, 3),
and whether these are a first guess: whatever else a residual may hold, whitened at one standard deviation, (N, M)."""


def fit_base(
    clip: Clip, whiten: Whitener, nuisances: Nuisances, memo: Memo, *,
    rounds: int = ROUNDS, workers: int = 1, timing: bool = True, begun: Base | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> tuple[Clip, Base]:  # fmt: skip
    """E, nu and eta, and when grips open; the clip with the latter, and the base.

    Begun anew, at most `rounds` times,
    where a run fits worse than the tangent and the short runs before it promised. timing: whether the moments of
    releases are free; begun: a base of nearly the same body.
    """
    late = [float(clip.opening[j, t]) for j, t in clip.releases()] if timing else []
    y, promised = np.concatenate([START if begun is None else begun.x, late]), np.inf
    others = np.zeros((DRAWS, 3)) if begun is None else begun.known.aside
    bodies = [clip.prepared(TERMS) for _ in range(workers)]
    prepared = bodies[0]
    carry = prepared.simulator.carry(clip.rest)
    for n in range(rounds + 1):
        clip = clip.opens(y[3:])
        say(f"base, run {n + 1}: {told(y)}")
        if n == 0:
            y[:3], (drive, run) = _standing(prepared, clip, y[:3], memo, clip.frames)
        else:
            drive, run = simulate(prepared, clip, y[:3], memo, clip.frames)
        simulated = carried(carry, run)
        near = tangent(prepared, values_of(y[:3]), drive, run, clip.rest, clip.until)
        if n < 2:
            sits = by_place(prepared, clip, run)
            space = metric(nuisances(clip, y[:3], simulated, sits, n == 0 and begun is None))
        around = RingDown(
            clip, whiten, space, memo, bodies, carry, y.copy(), run, simulated[:, : clip.until],
            _by_poisson(prepared, near, y[:3]),
        )  # fmt: skip
        if n > 0:
            cost = around.cost(y, around.left(y))
            if n == rounds or cost < promised + AGAIN + ASIDE * max(cost - whiten.free, 0.0):
                break
        if n == 0 and begun is None:
            ends = around.descents(say)
            y, others = softest(ends).y, aside(ends)
        else:
            y = _on(around, y, say)
        promised = around.cost(y, around.left(y))
    slopes = around.slopes(y)
    known = Known(np.linalg.inv(around.normal(slopes))[:3, :3], others)
    x = y[:3]
    units = slopes[:3] * SPREAD[:, None, None, None]
    return clip, Base(x, prepared, drive, run, simulated, near, units, known, at_bound(x, clip))


def _on(around: RingDown, y: np.ndarray, say: Callable[[str], None]) -> np.ndarray:
    """Where a descent from y ends, (3 + R,)."""
    at = around.begun(y)
    around.descend(at, say)
    return at.y


def without(case, response: np.ndarray, say: Callable[[str], None]) -> list[Descent]:
    """Bases of a `diagnose.Case` once a law's response over the whole clip [m], (K, T, 3), is taken off, best first.

    Where something is hidden,
    a base makes up for it with numbers that no step from there leads back from.
    """
    clip, base, until = case.clip, case.base, case.clip.until
    late = [float(clip.opening[j, t]) for j, t in clip.releases()] if "release" not in case.settings.without else []
    rest = replace(clip, moved=clip.moved - response * clip.seen[..., None])
    bodies = [base.prepared, *(clip.prepared(TERMS) for _ in range(case.workers - 1))]
    around = RingDown(
        rest, case.whiten, case.beside_base, case.memo, bodies, base.prepared.simulator.carry(clip.rest),
        np.concatenate([base.x, late]), base.run, base.simulated[:, :until], base.slopes[1] / SPREAD[1],
    )  # fmt: skip
    return around.descents(say)


def settled(clip: Clip, whiten: Whitener, space: Metric, slopes: slice, base: Base, memo: Memo) -> Base:
    """The base where everything that is open beside it puts it, and how surely, once all of that is known.

    space: with the base's own slopes in columns `slopes`, each at a prior standard deviation.
    """
    until, found = clip.until, base

    def misfit(at: Base) -> tuple[float, np.ndarray]:
        z = whiten(clip.moved[:, :until] - at.simulated[:, :until])
        return float(space.gram(z[:, None], z[:, None])[0, 0]), space.likely(z)[slopes]

    least, likely = misfit(base)
    for _ in range(NEWTONS):
        x = bounded(found.x + np.clip(likely, -1, 1) * SPREAD, clip)
        if np.abs((x - found.x) / SPREAD).max() < SETTLED:
            break
        try:
            drive, run = simulate(base.prepared, clip, x, memo, clip.frames)
        except Breakdown:
            break
        moved = replace(
            found, x=x, drive=drive, run=run, simulated=carried(base.prepared.simulator.carry(clip.rest), run)
        )
        cost, likely = misfit(moved)
        if cost > least - 1.0:
            break
        found, least = moved, cost
    if found is not base:
        near = tangent(base.prepared, values_of(found.x), found.drive, found.run, clip.rest, until)
        found = replace(found, tangent=near)
    open_to = np.linalg.inv(np.eye(space.columns.shape[1]) + (space.columns.T @ space.columns).astype(float))
    told = (np.linalg.inv(open_to[slopes, slopes]) - np.eye(3)) / calibration.ALIKE_ERRORS
    near = np.linalg.inv(np.eye(3) + told) * np.outer(SPREAD, SPREAD)
    return replace(found, known=replace(base.known, near=near), bound=at_bound(found.x, clip))


def _standing(prepared: Prepared, clip: Clip, x: np.ndarray, memo: Memo, frames: int):
    """The first of ever stiffer bodies that is not torn apart: its numbers, drive and run."""
    while True:
        try:
            return x, simulate(prepared, clip, x, memo, frames)
        except Breakdown:
            stiffer = bounded(x + np.array([STIFFER, 0.0, 0.0]), clip)
            if stiffer[0] == x[0]:
                raise
            x = stiffer


def _by_poisson(prepared, near: Tangent, x) -> np.ndarray:
    """Derivative of the points' displacement by nu [m], (K, T_fit, 3)."""
    values, more = values_of(x), values_of(x - [0, 1e-4, 0])
    loads = []
    for frame in near.frames:
        F = near.gradient(frame)
        loads.append(near.of_stress((base_piola(prepared, values, F) - base_piola(prepared, more, F)) / 1e-4))
    return near.over_time(near.at_states(np.stack(loads)[:, None])[:, 0])
