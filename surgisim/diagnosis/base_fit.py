"""The base's fit, together with the nuisances, before anything is called missing.

Stiffness does not matter where tissue is driven by displacements and comes to rest between frames; it is told,
with the viscosity, by what a release looks like. So Poisson's ratio is searched through the tangent stiffness of the
last run, E and eta through short runs that begin just before the first release (`ring_down.py`); where nothing is
released, through whole runs.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from surgisim.diagnosis import calibration
from surgisim.diagnosis.base import (
    TERMS,
    Base,
    Known,
    at_bound,
    bounded,
    carried,
    displacement_gradient,
    simulate,
    softness,
    values_of,
    values_on,
)
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.metric import Metric, metric
from surgisim.diagnosis.noise import Whitener
from surgisim.diagnosis.prior import USUAL
from surgisim.diagnosis.pulls import Pulls, pulls
from surgisim.diagnosis.ring_down import ASIDE, DRAWS, Descent, RingDown, aside, softest, told
from surgisim.diagnosis.tangent import Tangent, base_piola, tangent
from surgisim.estimation.trial import at_once
from surgisim.mpm.grip import Drive
from surgisim.mpm.setup import Prepared
from surgisim.mpm.simulator import Breakdown, Run

ROUNDS, AGAIN = 3, 25.0
"""Fits at most, and what chi square a run may cost beyond what the last one promised; chosen: 3 where it went well."""
NEWTONS, SETTLED = 2, 0.1
"""Steps at most by which grips, held tissue and elastic law, once they are known, move the base, and what counts as
none, in prior standard deviations."""
STIFFER = np.log(3.0)
"""Step of log E where the body to begin with is torn apart."""
VALLEYS, FOLLOWED = 0.5, 4
"""Prior standard deviations beyond which descents ended in two valleys, and how many of these, best first, are gone
down on the finer grid: of two moments of a release it may put the other first."""
SOFTER, INDEPENDENT, MATCHES, NEAR = 0.3, 8, 4, 0.1
"""Prior standard deviation of how much softer a coarse grid's tissue is than a finer one's, in logarithms of E and of
eta / E; as how many independent samples all else counts by which grids differ; fits at most; step of differences."""


Nuisances = Callable[[Clip, np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Of a clip, a base's tracks [m], (K, T, 3), their displacement gradient [1], (3, K, T, 3), and what a finer grid
changes in them [m], (K, T, 3): whatever else a residual may hold, whitened at one standard deviation, (N, M)."""


@dataclass(frozen=True)
class Laid:
    """The base on one grid, ready to run."""

    clip: Clip
    bodies: list[Prepared]
    """One for each run at a time."""
    carry: object

    @classmethod
    def on(cls, clip: Clip, workers: int) -> "Laid":
        bodies = [clip.prepared(TERMS) for _ in range(workers)]
        return cls(clip, bodies, bodies[0].simulator.carry(clip.rest))

    def opens(self, late: np.ndarray) -> "Laid":
        return replace(self, clip=self.clip.opens(late))

    def stiffened(self, by: np.ndarray) -> "Laid":
        """Where numbers are taken so much stiffer, (3,)."""
        return replace(self, clip=replace(self.clip, stiffer=by))

    def run(self, x: np.ndarray, memo: Memo) -> tuple[Drive, Run, np.ndarray]:
        """With numbers x, (3,): drive, run and displacement of the points [m], (K, T, 3)."""
        drive, run = simulate(self.bodies[0], self.clip, x, memo, self.clip.frames)
        return drive, run, carried(self.carry, run)


@dataclass(frozen=True)
class Ran:
    """The base with some numbers on the clip's grid, and how a finer one shows it."""

    laid: Laid
    """Its clip with what numbers must be `stiffer` by there."""
    x: np.ndarray
    """(3,)"""
    drive: Drive
    run: Run
    simulated: np.ndarray
    """Displacement of the points [m], (K, T, 3)."""
    finer: Laid
    """The same as `laid` where no finer grid is asked for, or where the engine breaks down there."""
    finer_run: Run
    finer_simulated: np.ndarray

    @classmethod
    def at(cls, x: np.ndarray, laid: Laid, finer: Laid | None, whiten: Whitener, memo: Memo) -> "Ran":
        """With numbers x, or those of the first stiffer body that stands."""
        x, ran = _standing(laid, x, memo)
        there = None if finer is None else _ran(finer, x, memo)
        if there is None:
            return cls(laid, x, *ran, laid, *ran[1:])
        softened = laid.stiffened(_softened(laid, x, ran[1], ran[2], there[2], whiten, memo))
        again = _ran(softened, x, memo)
        if again is not None:
            laid, ran = softened, again
        return cls(laid, x, *ran, finer, *there[1:])

    @property
    def clip(self) -> Clip:
        return self.laid.clip

    @property
    def error(self) -> np.ndarray:
        """What the finer grid changes [m], (K, T, 3)."""
        return self.finer_simulated - self.simulated

    def tangent(self) -> Tangent:
        values = values_on(self.clip, self.x)
        return tangent(self.laid.bodies[0], values, self.drive, self.run, self.clip.rest, self.clip.until)

    def by_poisson(self, near: Tangent) -> np.ndarray:
        """Derivative of the points' displacement by nu [m], (K, T_fit, 3)."""
        return _by_poisson(self.laid.bodies[0], near, self.clip.on_grid(self.x))

    def pulls(self, memo: Memo) -> Pulls | None:
        """Forces near this run on the finer grid, where any were measured."""
        finer = self.finer
        return pulls(finer.clip, finer.bodies[0], self.x, self.finer_run, lambda x: finer.run(x, memo)[1])

    def metric(self, nuisances: Nuisances, error: np.ndarray) -> Metric:
        gradient = displacement_gradient(self.laid.bodies[0], self.clip, self.run)
        return metric(nuisances(self.clip, self.simulated, gradient, error))


def fit_base(
    clip: Clip, whiten: Whitener, nuisances: Nuisances, memo: Memo, *,
    finer: float | None = None, rounds: int = ROUNDS, workers: int = 1, timing: bool = True, begun: Base | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> tuple[Clip, Base, Laid]:  # fmt: skip
    """E, nu and eta, and when grips open; the clip with the latter, the base, and the grid that it was fitted on.

    A coarse grid's tissue rings slower, and stiffer numbers would make up for it. So numbers are those of a grid of
    spacing `finer`, over the cube root of the body's volume: where the best of descents from all over the range got to
    on the clip's grid, they go on on the finer one. Runs on the clip's take numbers as much `stiffer` as makes it move
    like that, and what is then still left between the grids is the clip's `error`. Begun anew, at most `rounds` times,
    where a run fits worse than the short runs before it promised. timing: whether the moments of releases are free;
    begun: a base of nearly the same body.
    """
    late = [float(clip.opening[j, t]) for j, t in clip.releases()] if timing else []
    y, promised, ends = np.concatenate([clip.prior.middle if begun is None else begun.x, late]), np.inf, []
    others = np.zeros((DRAWS, 3)) if begun is None else begun.known.aside
    laid = Laid.on(clip, workers)
    fine = None if finer is None else Laid.on(clip.laid(share=finer), workers)
    if begun is None:
        say(f"base: {told(y)}")
        ran = Ran.at(y[:3], laid, fine, whiten, memo)
        ends = _all_over(ran, y[3:], whiten, nuisances, memo, say)
        laid, y = ran.laid, softest(ends).y
    for n in range(rounds + 1):
        say(f"base, run {n + 1}: {told(y)}")
        ran = Ran.at(y[:3], laid.opens(y[3:]), None if fine is None else fine.opens(y[3:]), whiten, memo)
        laid, y, near = ran.laid, np.concatenate([ran.x, y[3:]]), ran.tangent()
        if n < 2:
            space = ran.metric(nuisances, ran.error)
        around = RingDown(
            ran.finer.clip, whiten, space, memo, ran.finer.bodies, ran.finer.carry, y, ran.finer_run,
            ran.finer_simulated[:, : clip.until], ran.by_poisson(near), ran.pulls(memo),
        )  # fmt: skip
        if n > 0:
            cost = around.cost(y, around.left(y))
            if n == rounds or cost < promised + AGAIN + ASIDE * max(cost - whiten.free, 0.0):
                break
        if ends:
            valleys = around.distinct(ends, VALLEYS)[:FOLLOWED]
            found = around.descents(say, [around.begun(end.y) for end in valleys])
            y, others, ends = softest(found).y, aside(found), []
        else:
            y = _on(around, y, say)
        promised = around.cost(y, around.left(y))
    slopes = around.slopes(y)
    known = Known(np.linalg.inv(around.normal(slopes, y))[:3, :3], others)
    units = slopes[:3] * clip.prior.spread[:, None, None, None]
    clip = ran.clip.less(None if ran.finer is laid else ran.error)
    bound = at_bound(ran.x, clip)
    base = Base(
        ran.x, laid.bodies[0], ran.drive, ran.run, ran.simulated, near, units, known, bound, clip.prior, around.pulls
    )
    return clip, base, ran.finer


def _all_over(
    ran: Ran, late: np.ndarray, whiten: Whitener, nuisances: Nuisances, memo: Memo, say: Callable[[str], None]
) -> list[Descent]:
    """Where descents from all over the range, and from moments of release `late`, (R,), get to on the clip's grid, best
    first."""
    # How a body of other numbers rings says nothing of how this one does.
    error = ran.error * ran.clip.held[None, :, None]
    clip = ran.clip.less(error)
    around = RingDown(
        clip, whiten, ran.metric(nuisances, error), memo, ran.laid.bodies, ran.laid.carry,
        np.concatenate([ran.x, late]), ran.run, ran.simulated[:, : clip.until], ran.by_poisson(ran.tangent()),
        ran.pulls(memo),
    )  # fmt: skip
    return around.descents(say)


def _softened(
    laid: Laid, x: np.ndarray, run: Run, simulated: np.ndarray, there: np.ndarray, whiten: Whitener, memo: Memo
) -> np.ndarray:
    """What numbers on this grid must be stiffer by, (3,), to move as a finer grid does.

    run, simulated: on this grid; there: on the finer one [m], (K, T, 3). Read off what tissue does once let go, or off
    all frames where nothing is; what else the grids differ by counts as its noise. As it was where the engine breaks
    down.
    """
    clip, ways, until = laid.clip, np.eye(3)[[0, 2]], laid.clip.until
    nothing = metric(np.zeros((3 * whiten.mask.size, 0)))
    simulated, by_poisson = simulated[:, :until], np.zeros_like(there[:, :until])
    around = RingDown(clip, whiten, nothing, memo, laid.bodies, laid.carry, x, run, simulated, by_poisson)
    free = ~clip.held[:until] if clip.releases() else np.ones(until, bool)

    def left(raised: np.ndarray, body: int = 0) -> np.ndarray:
        return whiten((there[:, :until] - around.tracks(x - clip.stiffer + raised, body)) * free[:, None])

    raised, tried = clip.stiffer, []
    try:
        for _ in range(MATCHES):
            here, *moved = at_once(left, [raised, *(raised + NEAR * way for way in ways)], len(laid.bodies))
            tried.append((float(here @ here), raised))
            J = np.stack([here - m for m in moved], 1) / NEAR
            weight = INDEPENDENT / max(tried[-1][0], 1e-30)
            normal = weight * J.T @ J + np.eye(2) / SOFTER**2
            step = np.linalg.solve(normal, weight * J.T @ here - raised[[0, 2]] / SOFTER**2) @ ways
            if np.abs(step).max() < SETTLED * SOFTER:
                break
            raised = raised + step
    except Breakdown:
        return clip.stiffer
    return min(tried, key=lambda t: t[0])[1]


def _ran(laid: Laid, x: np.ndarray, memo: Memo) -> tuple[Drive, Run, np.ndarray] | None:
    """None where the engine breaks down."""
    try:
        return laid.run(x, memo)
    except Breakdown:
        return None


def _on(around: RingDown, y: np.ndarray, say: Callable[[str], None]) -> np.ndarray:
    """Where a descent from y ends, (3 + R,)."""
    at = around.begun(y)
    around.descend(at, say)
    return at.y


def without(case, response: np.ndarray, say: Callable[[str], None]) -> list[Descent]:
    """Bases of a `diagnose.Case` once a law's response over the whole clip [m], (K, T, 3), is taken off, best first.

    Where something is hidden, a base makes up for it with numbers that no step from there leads back from.
    """
    clip, base, until = case.clip, case.base, case.clip.until
    late = [float(clip.opening[j, t]) for j, t in clip.releases()] if "release" not in case.settings.without else []
    rest = replace(clip, moved=clip.moved - response * clip.seen[..., None])
    bodies = [base.prepared, *(clip.prepared(TERMS) for _ in range(case.workers - 1))]
    around = RingDown(
        rest, case.whiten, case.beside_base, case.memo, bodies, base.prepared.simulator.carry(clip.rest),
        np.concatenate([base.x, late]), base.run, base.simulated[:, :until], base.slopes[1] / clip.prior.spread[1],
    )  # fmt: skip
    return around.descents(say)


def settled(
    clip: Clip, fine: Laid, whiten: Whitener, space: Metric, slopes: slice, base: Base, memo: Memo
) -> tuple[Clip, Base]:
    """The base where everything that is open beside it puts it, and how surely, once all of that is known; the clip.

    fine: the grid that it is fitted on; space: with the base's own slopes in columns `slopes`, each at a prior standard
    deviation.
    """
    until, x, spread, forces = clip.until, base.x, clip.prior.spread, base.pulls
    open_to = np.linalg.inv(np.eye(space.columns.shape[1]) + (space.columns.T @ space.columns).astype(float))
    surely = np.linalg.inv(open_to[slopes, slopes])
    observed = clip.less(None).moved[:, :until]

    def misfit(there: np.ndarray, x: np.ndarray) -> tuple[float, np.ndarray]:
        z = whiten(observed - there[:, :until])
        cost, likely = float(space.gram(z[:, None], z[:, None])[0, 0]), space.likely(z)[slopes]
        # The metric's prior is about the base as it was fitted; what is known of this body is about its own middle.
        off = np.where(clip.prior.spread < USUAL.spread, (x - clip.prior.middle) / spread, 0.0)
        cost, likely = cost + float(off @ off), likely - np.linalg.solve(surely, off)
        if forces is None:
            return cost, likely
        J = forces.slopes(x) * spread
        both = np.linalg.solve(surely + J.T @ J, surely @ likely + J.T @ forces.left(x))
        return cost + forces.cost(x), both

    plain = base.simulated if clip.error is None else base.simulated + clip.error
    least, likely = misfit(plain, x)
    for _ in range(NEWTONS):
        tried = bounded(x + np.clip(likely, -1, 1) * spread, clip)
        found = None if np.abs((tried - x) / spread).max() < SETTLED else _ran(fine, tried, memo)
        if found is None:
            break
        cost, likely = misfit(found[2], tried)
        if cost > least - 1.0:
            break
        x, plain, least = tried, found[2], cost
    if x is not base.x:
        own = Laid(clip, [base.prepared], base.prepared.simulator.carry(clip.rest))
        drive, run, simulated = own.run(x, memo)
        near = tangent(base.prepared, values_on(clip, x), drive, run, clip.rest, until)
        base = replace(base, x=x, drive=drive, run=run, simulated=simulated, tangent=near)
        clip = clip.less(None if clip.error is None else plain - simulated)
    told = (surely - np.eye(3)) / calibration.ALIKE_ERRORS
    if forces is not None:
        told = told + (forces.slopes(x) * spread).T @ (forces.slopes(x) * spread)
    near = np.linalg.inv(np.eye(3) + told) * np.outer(spread, spread) + softness(clip)
    return clip, replace(base, known=replace(base.known, near=near), bound=at_bound(x, clip))


def _standing(body: Laid, x: np.ndarray, memo: Memo):
    """The first of ever stiffer bodies that is not torn apart: its numbers; drive, run and tracks."""
    while True:
        try:
            return x, body.run(x, memo)
        except Breakdown:
            stiffer = bounded(x + np.array([STIFFER, 0.0, 0.0]), body.clip)
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
