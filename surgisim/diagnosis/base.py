"""The honest base: few numbers, fitted together with the nuisances, before anything is called missing.

Stiffness does not matter where tissue is driven by displacements and comes to rest between frames; it is told,
with the viscosity, by what a release looks like. So Poisson's ratio is searched through the tangent stiffness of the
last run, E and eta through short runs that begin just before the first release; where nothing is
released, through whole runs.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from surgisim.diagnosis import calibration
from surgisim.diagnosis.clip import OPENS, Clip
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.metric import Metric, metric
from surgisim.diagnosis.noise import Whitener
from surgisim.diagnosis.tangent import Tangent, base_piola, tangent
from surgisim.estimation.trial import at_once
from surgisim.mpm.closing import follow
from surgisim.mpm.grip import Drive
from surgisim.mpm.setup import Prepared, Values
from surgisim.mpm.simulator import Breakdown, Run
from surgisim.problem import Problem

TERMS = ("neo_hookean_ciarlet", "newtonian")
START = np.array([np.log(5e3), 0.45, np.log(2e-3)])
"""log E [Pa], nu, log eta / E [s]: soft tissue and silicone gels lie between 1 and 50 kPa and .3 and 20 ms."""
SPREAD = np.array([1.2, 0.03, 1.4])
LOW, HIGH = np.array([np.log(2e2), 0.30, np.log(5e-5)]), np.array([np.log(1e6), 0.49, np.log(5e-2)])
STEP = np.array([0.2, 0.01, 0.3])
NAMES = ("E", "nu", "eta / E")
HELD = 1e-3
"""Standard deviation of where what is held ends [m]: nobody glues to the millimetre."""
LATE = 0.5
"""Standard deviation of the moment of a release about the middle of the interval in which it falls [frames]; one that
is the same everywhere in it has .29, and whoever marks frames may be a frame off."""
EARLIEST, LATEST = -1.4, 2.4
"""Of a release after a grip's last active frame that is tried [frames]."""
SLOWER = 8
"""Times that viscosity may shorten the stable step of tissue of the usual stiffness (`mpm/stable.py`). To a base
without memory, tissue that relaxes looks viscous without bound, and its runs would take minutes each."""
STIFFNESSES = tuple(np.log(np.array([1e3, 2.2e3, 5e3, 1.2e4, 3e4])) - START[0])
LAGS = tuple(np.log(np.array([2e-4, 2e-3, 1.2e-2])) - START[2])
MOMENTS = (0.0, 0.5, 1.0)
"""Where a descent may start, in logarithms of E and of eta / E away from START, and moments of release [frames]: a
ring-down misfits by whole periods, one that is faster than the frames looks like a slower one, and a soft body let go
early looks like a stiff one let go late."""
DESCENTS_FROM = 4
"""Of those, from how many a descent starts."""
STIFFER = np.log(3.0)
"""Step of log E where the body to begin with is torn apart."""
DESCENTS, HOPE = 8, 4.0
"""Steps of it at most, and how many more like its last one it is given to become the best."""
SAFETY, BOLD = 0.8, 1.2
"""Share of the largest step that is guarded (`mpm/stable.py`) that a law's simulation takes, and that a diagnosis' runs
try first: tracks then differ by some micrometres, and runs break down only from 1.6 on. One that does is run again with
SAFETY."""
ALIKE = 2.0
"""What chi square a softer body may cost more. Tissue that creeps back tells eta / E alone: of bodies that look alike
the softest takes the longest steps."""
ROUNDS, AGAIN = 3, 25.0
"""Fits at most, and what chi square a run may cost beyond what the last one promised; chosen: 3 where it went well."""
ASIDE = 0.05
"""Share of what a base leaves unexplained, noise aside, below which nothing about it is worth another step: where
something is hidden no base fits, and its numbers are fitted again with every law."""
NEWTONS, SETTLED = 2, 0.1
"""Steps at most by which grips, held tissue and elastic law, once they are known, move the base, and what counts as
none, in prior standard deviations."""
AFTER = 0.5
"""How long a short run goes on after the release [s]."""


@dataclass(frozen=True)
class Base:
    x: np.ndarray
    """(3,)"""
    prepared: Prepared
    drive: Drive
    run: Run
    simulated: np.ndarray
    """Displacement of the points over the whole clip [m], (K, T, 3)."""
    tangent: Tangent
    slopes: np.ndarray
    """Of the points by x, at one prior standard deviation [m], (3, K, T_fit, 3)."""
    spread: np.ndarray
    """Posterior standard deviation of x, (3,)."""
    bound: tuple[str, ...] = ()
    """Numbers that came to the end of what is tried: the recording does not tell them."""

    @property
    def values(self) -> Values:
        return values_of(self.x)


def values_of(x: np.ndarray) -> Values:
    E, nu = float(np.exp(x[0])), float(x[1])
    return {TERMS[0]: {"E": E, "nu": nu}, TERMS[1]: {"eta": E * float(np.exp(x[2]))}}


def bounded(x: np.ndarray, clip: Clip) -> np.ndarray:
    """The nearest numbers that are tried, (3,)."""
    x = np.clip(x, LOW, HIGH)
    return np.array([x[0], x[1], min(x[2], longest_lag(x[0], clip))])


def longest_lag(log_E: float, clip: Clip) -> float:
    """log eta / E beyond which steps would be too short."""
    E, nu, rho, dx = np.exp(START[0]), START[1], clip.density, clip.body.spacing
    elastic = dx / 2 / np.sqrt(E * (1 - nu) / (1 + nu) / (1 - 2 * nu) / rho)
    most = rho * dx**2 / 5 / (elastic / SLOWER)
    return float(np.log(most) - log_E)


def fit_base(
    clip: Clip, whiten: Whitener, nuisances: Callable[[Clip, np.ndarray, np.ndarray, bool], np.ndarray], memo: Memo, *,
    rounds: int = ROUNDS, workers: int = 1, timing: bool = True, begun: np.ndarray | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> tuple[Clip, Base]:  # fmt: skip
    """E, nu and eta, and when grips open; the clip with the latter, and the base.

    nuisances: of a clip, a base's numbers (3,), its tracks [m], (K, T, 3), and whether these are a first guess,
    whatever else a residual may hold, whitened at one standard deviation, (N, M). Begun anew, at most `rounds` times,
    where a run fits worse than the tangent and the short runs before it promised. timing: whether the moments of
    releases are free.
    """
    releases = clip.releases() if timing else []
    late = [float(clip.opening[j, t]) for j, t in releases]
    y, promised = np.concatenate([START if begun is None else begun, late]), np.inf
    bodies = [clip.prepared(TERMS) for _ in range(workers)]
    prepared = bodies[0]
    carry = prepared.simulator.carry(clip.rest)
    for n in range(rounds + 1):
        clip = set_to(clip, y, releases)
        say(f"base, run {n + 1}: {told(y, releases)}")
        if n == 0:
            y[:3], (drive, run) = _standing(prepared, clip, y[:3], memo, clip.frames)
        else:
            drive, run = simulate(prepared, clip, y[:3], memo, clip.frames)
        simulated = carried(carry, run)
        near = tangent(prepared, values_of(y[:3]), drive, run, clip.rest, clip.until)
        if n < 2:
            space = metric(nuisances(clip, y[:3], simulated, n == 0 and begun is None))
        around = _Around(
            clip, whiten, space, memo, bodies, carry, y.copy(), run, simulated[:, : clip.until],
            _by_poisson(prepared, near, y[:3]), releases,
        )  # fmt: skip
        if n > 0:
            cost = around.cost(y, around.left(y))
            if n == rounds or cost < promised + AGAIN + ASIDE * max(cost - whiten.free, 0.0):
                break
        y = around.best(say) if n == 0 and begun is None else around.descend(y, say)
        promised = around.cost(y, around.left(y))
    slopes = around.slopes(y)
    spread = np.sqrt(np.diag(np.linalg.inv(around.normal(slopes))))[:3]
    x = y[:3]
    units = slopes[:3] * SPREAD[:, None, None, None]
    return clip, Base(x, prepared, drive, run, simulated, near, units, spread, at_bound(x, clip))


def at_bound(x: np.ndarray, clip: Clip) -> tuple[str, ...]:
    """Names of numbers (3,) that lie at an end of what is tried."""
    ends = (x - LOW < 0.02 * SPREAD) | (HIGH - x < 0.02 * SPREAD)
    ends[2] |= longest_lag(x[0], clip) - x[2] < 0.02
    return tuple(name for name, end in zip(NAMES, ends, strict=True) if end)


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
    # As uncertain as a verdict takes evidence to be: what grid and mesh still have wrong is alike in many samples.
    told = (1 / np.diag(open_to)[slopes] - 1) / calibration.TEMPERATURE
    return replace(found, spread=SPREAD / np.sqrt(1 + told), bound=at_bound(found.x, clip))


def set_to(clip: Clip, y: np.ndarray, releases: list[tuple[int, int]]) -> Clip:
    """The clip with grips that open as y says, (3 + R,)."""
    late = clip.opening.copy()
    for (j, t), after in zip(releases, y[3:], strict=True):
        late[j, t] = after
    # Later releases, of which nothing is fitted, are taken to fall as those that are.
    if len(releases):
        shown = np.zeros(late.shape, bool)
        shown[tuple(np.array(releases).T)] = True
        late[~shown] = y[3:].mean()
    return replace(clip, late=late)


def told(y: np.ndarray, releases: list) -> str:
    opens = f", opens {' and '.join(f'{late:.2f}' for late in y[3:])} frames late" if releases else ""
    return f"E {np.exp(y[0]):.0f} Pa, nu {y[1]:.3f}, eta {np.exp(y[0] + y[2]):.2f} Pa s{opens}"


def by_held(clip: Clip, x: np.ndarray, simulated: np.ndarray, memo: Memo) -> np.ndarray:
    """Derivative of the points' displacement by where what is held ends [1], (K, T, 3), by the engine."""
    for by in (HELD, -HELD) if clip.body.held.any() else ():
        try:
            moved = tracks_of(clip.laid(raised=clip.raised + by), x, memo)
        except (Breakdown, Problem):
            # Nothing free, or nothing held, is left there.
            continue
        return (moved - simulated) / by
    return np.zeros_like(simulated)


def tracks_of(clip: Clip, x: np.ndarray, memo: Memo, terms: tuple[str, str] = TERMS) -> np.ndarray:
    """Displacement of the points over the whole clip [m], (K, T, 3), with E, nu and eta of x."""
    prepared = clip.prepared(terms)
    values = dict(zip(terms, values_of(x).values(), strict=True))

    def make() -> dict[str, np.ndarray]:
        run = _run(prepared, clip, values, last=clip.frames - 1)
        return {"seen": carried(prepared.simulator.carry(clip.rest), run)}

    motion = [clip.motion.radius.tolist(), clip.motion.center_rest.tolist(), np.round(clip.motion.position, 9).tolist()]
    return memo(["tracks", terms, x.tolist(), *motion, *clip.kind], make)["seen"]


@dataclass(frozen=True)
class _Around:
    """Tracks near a run at `x`: nu moves them along its slope; E, eta and moments of release by short runs from the
    run's own states."""

    clip: Clip
    whiten: Whitener
    space: Metric
    memo: Memo
    bodies: list[Prepared]
    """One for each short run at a time."""
    carry: object
    x: np.ndarray
    """(3 + R,)"""
    run: Run
    simulated: np.ndarray
    by_poisson: np.ndarray
    releases: list[tuple[int, int]]

    @property
    def middle(self) -> np.ndarray:
        """Of the prior, (3 + R,)."""
        return np.concatenate([START, np.full(len(self.releases), OPENS)])

    @property
    def reach(self) -> np.ndarray:
        """Its standard deviation, (3 + R,)."""
        return np.concatenate([SPREAD, np.full(len(self.releases), LATE)])

    def bounded(self, y: np.ndarray) -> np.ndarray:
        return np.concatenate([bounded(y[:3], self.clip), np.clip(y[3:], EARLIEST, LATEST)])

    def tracks(self, y: np.ndarray, body: int = 0) -> np.ndarray:
        """Displacement of the points [m], (K, T_fit, 3)."""
        rates = np.array([y[0], self.x[1], y[2]])
        clip = set_to(self.clip, np.concatenate([rates, y[3:]]), self.releases)
        result = self.simulated.copy()
        for first, last in _windows(self.clip):
            what = ["short", self.x.tolist(), rates.tolist(), first, last, *clip.kind]
            seen = self.memo(
                what,
                lambda f=first, t=last: {"seen": _short(clip, self.bodies[body], rates, self.run, self.carry, f, t)},
            )["seen"]
            result[:, first + 1 : last + 1] = seen
        return result + (y[1] - self.x[1]) * self.by_poisson

    def left(self, y: np.ndarray, body: int = 0) -> np.ndarray | None:
        """Whitened residual, (N,); None where tissue like that is torn apart."""
        try:
            return self.whiten(self.clip.moved[:, : self.clip.until] - self.tracks(y, body))
        except Breakdown:
            return None

    def cost(self, y: np.ndarray, left: np.ndarray | None) -> float:
        if left is None:
            return np.inf
        prior = (((y - self.middle) / self.reach) ** 2).sum()
        return float(self.space.gram(left[:, None], left[:, None])[0, 0] + prior)

    def slopes(self, y: np.ndarray) -> np.ndarray:
        """Derivative of the points' displacement by y [m], (3 + R, K, T_fit, 3)."""
        late = np.where(y[3:] > LATEST - 0.3, -0.2, 0.2)
        aside = np.concatenate([[STEP[0]], [STEP[2]], late])
        ways = np.eye(len(y))[[0, 2, *range(3, len(y))]]
        middle, *moved = at_once(
            self.tracks, [y, *(y + a * e for a, e in zip(aside, ways, strict=True))], len(self.bodies)
        )
        stiffer, slower, *later = ((m - middle) / a for m, a in zip(moved, aside, strict=True))
        return np.stack([stiffer, self.by_poisson, slower, *later])

    def normal(self, slopes: np.ndarray) -> np.ndarray:
        J = self.whiten(slopes).T
        return self.space.gram(J, J) + np.diag(1 / self.reach**2)

    def steady(self) -> np.ndarray:
        """Where the run began, with the nu that pull and hold ask for, which hardly depends on the other numbers."""
        y, left = self.x.copy(), self.left(self.x)
        if left is None:
            return y
        J = self.whiten(self.by_poisson)[:, None]
        normal = float(self.space.gram(J, J)[0, 0]) + 1 / SPREAD[1] ** 2
        y[1] += (float(self.space.gram(J, left[:, None])[0, 0]) - (y[1] - START[1]) / SPREAD[1] ** 2) / normal
        return self.bounded(y)

    def starts(self) -> list[np.ndarray]:
        """A few stiffnesses and viscosities, best first."""
        tries = [self.steady()]
        for e in STIFFNESSES:
            for lag, late in [(lag, MOMENTS[1]) for lag in LAGS] + [(LAGS[1], MOMENTS[0]), (LAGS[1], MOMENTS[2])]:
                y = tries[0].copy()
                y[[0, 2]], y[3:] = (START[0] + e, START[2] + lag), late
                # What may not be tried as it is is no start of its own; nor is a moment that nothing has.
                if np.allclose(self.bounded(y), y) and (self.releases or late == MOMENTS[1]):
                    tries.append(y)
        costs = at_once(lambda y, body: self.cost(y, self.left(y, body)), tries, len(self.bodies))
        return [tries[n] for n in np.argsort(costs, kind="stable")]

    def best(self, say: Callable[[str], None]) -> np.ndarray:
        """The best body of several descents, or a softer one that fits as well."""
        apart: list[np.ndarray] = []
        for y in self.starts():
            # Neighbours of a start end where it does.
            if all(np.abs((y - z) / self.reach)[[0, 2, *range(3, len(y))]].max() > 0.6 for z in apart):
                apart.append(y)
        ends, costs = [], []
        for y in apart[:DESCENTS_FROM]:
            ends.append(self.descend(y, say, min(costs, default=np.inf)))
            costs.append(self.cost(ends[-1], self.left(ends[-1])))
        return min((y for y, c in zip(ends, costs, strict=True) if c < min(costs) + ALIKE), key=lambda y: y[0])

    def descend(self, y: np.ndarray, say: Callable[[str], None], bar: float = np.inf) -> np.ndarray:
        """Levenberg-Marquardt from y; given up where it would not come below a cost of `bar`."""
        left = self.left(y)
        cost, damping = self.cost(y, left), 1e-2
        for n in range(DESCENTS):
            say(f"base: {told(y, self.releases)}")
            slopes = self.slopes(y)
            normal = self.normal(slopes)
            pull = self.space.gram(self.whiten(slopes).T, left[:, None])[:, 0] - (y - self.middle) / self.reach**2
            found = self.downhill(y, cost, normal, pull, damping)
            if found is None:
                return y
            there, left_there, cost_there, damping = found
            won = cost - cost_there
            little = won < max(1.0, 0.02 * ASIDE * (cost_there - self.whiten.free))
            done = little or (n > 0 and cost_there - HOPE * won > bar)
            y, left, cost, damping = there, left_there, cost_there, max(damping / 4, 1e-4)
            if done:
                return y
        return y

    def downhill(self, y: np.ndarray, cost: float, normal: np.ndarray, pull: np.ndarray, damping: float):
        """The first damped step that costs less: numbers, residual, cost and damping; None where there is none.

        A grip that opens before a frame instead of in it shows there at once, which no slope foretells: where a step
        runs into that, moments of release stay and the body alone moves.
        """
        for free in sorted({len(y), 3}, reverse=True):
            inner, more = normal[:free, :free], damping
            for _ in range(4):
                step = np.zeros(len(y))
                step[:free] = np.linalg.solve(inner + more * np.diag(np.diag(inner)), pull[:free])
                there = self.bounded(y + np.clip(step, -1.2 * self.reach, 1.2 * self.reach))
                left = self.left(there)
                less = self.cost(there, left)
                if less < cost:
                    return there, left, less, more
                more *= 8
        return None


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


def carried(carry, run: Run) -> np.ndarray:
    """Displacement of points [m], (K, T, 3)."""
    return np.stack([carry @ u.astype(float) for u in run.u], 1)


def simulate(prepared: Prepared, clip: Clip, x: np.ndarray, memo: Memo, frames: int) -> tuple[Drive, Run]:
    """The base up to frame `frames`, exclusive."""
    values = values_of(x)
    made = memo(["base", x.tolist(), frames, *clip.kind], lambda: vars(_run(prepared, clip, values, last=frames - 1)))
    return base_drive(prepared, clip, values), Run(**made)


def base_drive(prepared: Prepared, clip: Clip, values: Values, safety: float = BOLD) -> Drive:
    """What carries the base along."""
    per_frame = prepared.per_frame(values, clip.fps, safety)
    return prepared.drive(clip.motion, values, fps=clip.fps, per_frame=per_frame, frames=clip.frames, late=clip.opening)


def _run(prepared: Prepared, clip: Clip, values: Values, **span) -> Run:
    theta = prepared.theta(values)
    return boldly(lambda safety: follow(prepared.simulator, theta, base_drive(prepared, clip, values, safety), **span))


def boldly(run: Callable[[float], Run]) -> Run:
    """A run at a safety of the step, with BOLD first. Raises Breakdown where SAFETY breaks down too."""
    try:
        return run(BOLD)
    except Breakdown:
        return run(SAFETY)


def _by_poisson(prepared, near: Tangent, x) -> np.ndarray:
    """Derivative of the points' displacement by nu [m], (K, T_fit, 3)."""
    values, more = values_of(x), values_of(x - [0, 1e-4, 0])
    loads = []
    for frame in near.frames:
        F = near.gradient(frame)
        loads.append(near.of_stress((base_piola(prepared, values, F) - base_piola(prepared, more, F)) / 1e-4))
    return near.over_time(near.at_states(np.stack(loads)[:, None])[:, 0])


def _short(clip, prepared, x, run, carry, first, last) -> np.ndarray:
    moved = _run(prepared, clip, values_of(x), before=run if first else None, first=first, last=last)
    return carried(carry, moved)[:, 1:]


def _windows(clip: Clip) -> list[tuple[int, int]]:
    """From just before each release for a while, none overlapping; everything where nothing is released."""
    found: list[tuple[int, int]] = []
    for _, end in sorted(clip.releases(), key=lambda r: r[1]):
        first, last = max(end - 2, 0), min(clip.until - 1, end + math.ceil(AFTER * clip.fps))
        if found and first <= found[-1][1]:
            found[-1] = found[-1][0], max(last, found[-1][1])
        else:
            found.append((first, last))
    return found or [(0, clip.until - 1)]
