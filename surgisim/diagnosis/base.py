"""The honest base: few numbers, fitted together with the nuisances, before anything is called missing.

Stiffness does not matter where tissue is driven by displacements and comes to rest between frames; it is told,
with the viscosity, by what a release looks like. So Poisson's ratio is searched through the tangent stiffness of the
last run, E and eta through short runs that begin just before the first release; where nothing is
released, through whole runs.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.metric import Metric, metric
from surgisim.diagnosis.noise import Whitener
from surgisim.diagnosis.tangent import Tangent, base_piola, tangent
from surgisim.estimation.trial import at_once
from surgisim.mpm.closing import follow
from surgisim.mpm.grip import Drive
from surgisim.mpm.setup import Prepared, Values
from surgisim.mpm.simulator import Breakdown, Run

TERMS = ("neo_hookean_ciarlet", "newtonian")
START = np.array([np.log(3e3), 0.45, np.log(3e-3)])
"""log E [Pa], nu, log eta / E [s]."""
SPREAD = np.array([0.8, 0.03, 0.8])
LOW, HIGH = np.array([np.log(5e2), 0.30, np.log(3e-4)]), np.array([np.log(5e5), 0.485, np.log(3e-2)])
STEP = np.array([0.2, 0.01, 0.3])
SLOWER = 8
"""Times that viscosity may shorten the stable step of tissue of the usual stiffness (`mpm/stable.py`). To a base
without memory, tissue that relaxes looks viscous without bound, and its runs would take minutes each."""
SCAN = (-1.0, -0.35, 0.3, 1.0)
"""Where the descent may start, in logarithms of E and of eta / E away from START."""
STIFFER = np.log(3.0)
"""Step of log E where the body to begin with is torn apart."""
DESCENTS = 8
"""Steps of it at most."""
SAFETY, BOLD = 0.8, 1.2
"""Share of the largest step that is guarded (`mpm/stable.py`) that a law's simulation takes, and that a diagnosis' runs
try first: tracks then differ by some micrometres, and runs break down only from 1.6 on. One that does is run again with
SAFETY."""
SOFTER, ALIKE = 0.7, 2.0
"""How much softer, in log E, another descent begins, and what chi square its end may cost more. Tissue that creeps back
tells eta / E alone: of bodies that look alike the softest takes the longest steps."""
ROUNDS, AGAIN = 3, 25.0
"""Fits at most, and what chi square a run may cost beyond what the last one promised; chosen: 3 where it went well."""
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

    @property
    def values(self) -> Values:
        return values_of(self.x)


def values_of(x: np.ndarray) -> Values:
    E, nu = float(np.exp(x[0])), float(x[1])
    return {TERMS[0]: {"E": E, "nu": min(nu, 0.485)}, TERMS[1]: {"eta": E * float(np.exp(x[2]))}}


def bounded(x: np.ndarray, clip: Clip) -> np.ndarray:
    """The nearest numbers that are tried, (3,)."""
    x = np.clip(x, LOW, HIGH)
    E, nu, rho, dx = np.exp(START[0]), START[1], clip.density, clip.body.spacing
    elastic = dx / 2 / np.sqrt(E * (1 - nu) / (1 + nu) / (1 - 2 * nu) / rho)
    most = rho * dx**2 / 5 / (elastic / SLOWER)
    return np.array([x[0], x[1], min(x[2], np.log(most) - x[0])])


def fit_base(
    clip: Clip, whiten: Whitener, nuisances: np.ndarray, memo: Memo, *, rounds: int = ROUNDS, workers: int = 1,
    say: Callable[[str], None] = lambda text: None,
) -> Base:  # fmt: skip
    """Least squares over E, nu and eta, given nuisances whitened at one standard deviation, (N, M).

    Begun anew, at most `rounds` times, where a run fits worse than the tangent and the short runs before it promised.
    """
    x, promised = START.copy(), np.inf
    bodies = [clip.prepared(TERMS) for _ in range(workers)]
    prepared = bodies[0]
    carry = prepared.simulator.carry(clip.rest)
    space = metric(nuisances)
    for n in range(rounds + 1):
        say(f"base, run {n + 1}: E {np.exp(x[0]):.0f} Pa, nu {x[1]:.3f}, eta {np.exp(x[0] + x[2]):.2f} Pa s")
        if n == 0:
            x, (drive, run) = _standing(prepared, clip, x, memo, clip.until)
        else:
            drive, run = simulate(prepared, clip, x, memo, clip.frames)
        simulated = carried(carry, run)
        near = tangent(prepared, values_of(x), drive, run, clip.rest, clip.until)
        around = _Around(
            clip, whiten, space, memo, bodies, carry, x, run, simulated[:, : clip.until],
            _by_poisson(prepared, near, x),
        )  # fmt: skip
        if n > 0 and (n == rounds or around.cost(x, around.left(x)) < promised + AGAIN):
            break
        x = around.softest(say) if n == 0 else around.descend(x, say)
        promised = around.cost(x, around.left(x))
    slopes = around.slopes(x)
    spread = np.sqrt(np.diag(np.linalg.inv(around.normal(slopes))))
    return Base(x, prepared, drive, run, simulated, near, slopes * SPREAD[:, None, None, None], spread)


@dataclass(frozen=True)
class _Around:
    """Tracks near a run at `x`: nu moves them along its slope, E and eta by short runs from the run's own states."""

    clip: Clip
    whiten: Whitener
    space: Metric
    memo: Memo
    bodies: list[Prepared]
    """One for each short run at a time."""
    carry: object
    x: np.ndarray
    run: Run
    simulated: np.ndarray
    by_poisson: np.ndarray

    def tracks(self, y: np.ndarray, body: int = 0) -> np.ndarray:
        """Displacement of the points [m], (K, T_fit, 3)."""
        first, last = _window(self.clip)
        rates = np.array([y[0], self.x[1], y[2]])
        what = ["short", self.x.tolist(), rates.tolist(), first, last]
        seen = self.memo(
            what, lambda: {"seen": _short(self.clip, self.bodies[body], rates, self.run, self.carry, first, last)}
        )["seen"]
        result = self.simulated.copy()
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
        return float(self.space.gram(left[:, None], left[:, None])[0, 0] + (((y - START) / SPREAD) ** 2).sum())

    def slopes(self, y: np.ndarray) -> np.ndarray:
        """Derivative of the points' displacement by y [m], (3, K, T_fit, 3)."""
        aside = np.diag(STEP)
        middle, stiffer, slower = at_once(self.tracks, [y, y + aside[0], y + aside[2]], len(self.bodies))
        return np.stack([(stiffer - middle) / STEP[0], self.by_poisson, (slower - middle) / STEP[2]])

    def normal(self, slopes: np.ndarray) -> np.ndarray:
        J = self.whiten(slopes).T
        return self.space.gram(J, J) + np.diag(1 / SPREAD**2)

    def starts(self) -> list[np.ndarray]:
        """A few stiffnesses and viscosities, best first: a ring-down misfits by whole periods."""
        tries = [self.x, *(bounded(self.x + np.array([e, 0.0, lag]), self.clip) for e in SCAN for lag in SCAN)]
        costs = at_once(lambda y, body: self.cost(y, self.left(y, body)), tries, len(self.bodies))
        return [tries[n] for n in np.argsort(costs, kind="stable")]

    def softest(self, say: Callable[[str], None]) -> np.ndarray:
        """The best body, or a softer one that fits as well."""
        starts = self.starts()
        best = self.descend(starts[0], say)
        below = [y for y in starts[1:] if y[0] < best[0] - SOFTER]
        if not below:
            return best
        softer = self.descend(below[0], say)
        return softer if self.cost(softer, self.left(softer)) < self.cost(best, self.left(best)) + ALIKE else best

    def descend(self, y: np.ndarray, say: Callable[[str], None]) -> np.ndarray:
        """Levenberg-Marquardt from y."""
        left = self.left(y)
        cost, damping = self.cost(y, left), 1e-2
        for _ in range(DESCENTS):
            say(f"base: E {np.exp(y[0]):.0f} Pa, nu {y[1]:.3f}, eta {np.exp(y[0] + y[2]):.2f} Pa s")
            slopes = self.slopes(y)
            normal = self.normal(slopes)
            pull = self.space.gram(self.whiten(slopes).T, left[:, None])[:, 0] - (y - START) / SPREAD**2
            for _ in range(4):
                step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), pull)
                there = bounded(y + np.clip(step, -1.2 * SPREAD, 1.2 * SPREAD), self.clip)
                left_there = self.left(there)
                cost_there = self.cost(there, left_there)
                if cost_there < cost:
                    break
                damping *= 8
            else:
                return y
            done = cost - cost_there < 0.5
            y, left, cost, damping = there, left_there, cost_there, max(damping / 4, 1e-4)
            if done:
                return y
        return y


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
    made = memo(["base", x.tolist(), frames], lambda: vars(_run(prepared, clip, values, last=frames - 1)))
    return base_drive(prepared, clip, values), Run(**made)


def base_drive(prepared: Prepared, clip: Clip, values: Values, safety: float = BOLD) -> Drive:
    """What carries the base along."""
    per_frame = prepared.per_frame(values, clip.fps, safety)
    return prepared.drive(clip.motion, values, fps=clip.fps, per_frame=per_frame, frames=clip.frames)


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


def _window(clip: Clip) -> tuple[int, int]:
    """From just before the first release for a while; everything where nothing is released."""
    active = clip.motion.active[:, : clip.until] if len(clip.motion.active) else np.zeros((0, clip.until), bool)
    ends = [int(np.flatnonzero(a)[-1]) for a in active if a.any()]
    ends = [e for e in ends if e < clip.until - 3]
    if not ends:
        return 0, clip.until - 1
    return max(min(ends) - 1, 0), min(clip.until - 1, min(ends) + round(AFTER * clip.fps))
