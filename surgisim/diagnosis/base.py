"""The honest base: isotropic elastic tissue with viscosity, in few numbers, and its runs.

Its numbers x are log E, nu and log eta / E, and may be followed by the moments at which grips open (`Clip.opens`).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from surgisim.diagnosis import calibration
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.prior import SPREAD, START, USUAL, Prior
from surgisim.diagnosis.tangent import Tangent
from surgisim.mpm.closing import follow
from surgisim.mpm.grip import Drive
from surgisim.mpm.setup import Prepared, Values
from surgisim.mpm.simulator import Breakdown, Run
from surgisim.problem import Problem

if TYPE_CHECKING:
    from surgisim.diagnosis.pulls import Pulls

TERMS = ("neo_hookean_ciarlet", "newtonian")
LOW, HIGH = np.array([np.log(2e2), 0.30, np.log(5e-5)]), np.array([np.log(1e6), 0.49, np.log(5e-2)])
NAMES = ("E", "nu", "eta / E")
INCOMPRESSIBLE = 0.5
"""Poisson's ratio of what keeps its volume [1]; beyond it, pressure would make tissue larger."""
HELD = 1e-3
"""Standard deviation of where what is held ends [m]: nobody glues to the millimetre."""
STEP = 0.05
"""Of a cell: step of the differences that a displacement gradient is made of."""
TOLD = 0.7
"""Share of the spread that a number has beforehand below which a recording tells it: half of the variance [1]."""
FINE_ENOUGH = 0.4
"""Of how much softer than tissue a coarse grid is, over how much softer than the finer grid: standard deviation about 1
[1]."""
SLOWER = 8
"""Times that viscosity may shorten the stable step of tissue of the usual stiffness (`mpm/stable.py`). To a base
without memory, tissue that relaxes looks viscous without bound, and its runs would take minutes each."""
SAFETY, BOLD = 0.8, 1.2
"""Share of the largest step that is guarded (`mpm/stable.py`) that a law's simulation takes, and that a diagnosis' runs
try first: tracks then differ by some micrometres, and runs break down only from 1.6 on. One that does is run again with
SAFETY."""


@dataclass(frozen=True)
class Known:
    """How surely a base's numbers are known."""

    near: np.ndarray
    """Posterior covariance about them, (3, 3)."""
    aside: np.ndarray
    """How far from them other bodies lie that fit about as well, drawn as often as they do, (D, 3)."""

    @property
    def spread(self) -> np.ndarray:
        """Standard deviation, (3,)."""
        return np.sqrt(np.diag(self.near) + (self.aside**2).mean(0))

    def beside(self, left: float, prior: Prior) -> "Known":
        """The same where a law that nobody knows leaves so much chi square: its share of that is the numbers' too.

        prior: what was known of them beforehand.
        """
        surer, before = np.linalg.inv(self.near), np.diag(prior.spread**-2)
        less = calibration.ALIKE_ERRORS / calibration.temperature(calibration.ALIKE_ERRORS, left)
        return replace(self, near=np.linalg.inv(less * (surer - before) + before))

    def draws(self, x: np.ndarray) -> np.ndarray:
        """Numbers that would do, none of them incompressible or beyond, (at most D, 3)."""
        near = np.random.default_rng(len(self.aside)).multivariate_normal(np.zeros(3), self.near, len(self.aside))
        drawn = x[:3] + near + self.aside
        return drawn[drawn[:, 1] < INCOMPRESSIBLE]


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
    known: Known
    bound: tuple[str, ...] = ()
    """Numbers that came to the end of what is tried."""
    prior: Prior = USUAL
    """What was known of its numbers beforehand."""
    pulls: "Pulls | None" = None
    """Forces, where any were measured."""

    @property
    def spread(self) -> np.ndarray:
        """Posterior standard deviation of x, (3,)."""
        return self.known.spread

    @property
    def untold(self) -> tuple[str, ...]:
        """Names of numbers that the recording does not tell: at an end of what is tried, or hardly surer."""
        vague = self.spread > TOLD * SPREAD
        return tuple(name for name, v in zip(NAMES, vague, strict=True) if v or name in self.bound)

    @property
    def as_given(self) -> tuple[str, ...]:
        """Names of numbers that the recording makes hardly surer than they were known beforehand."""
        return tuple(name for name, v in zip(NAMES, self.spread > TOLD * self.prior.spread, strict=True) if v)


def values_of(x: np.ndarray) -> Values:
    E, nu = float(np.exp(x[0])), float(x[1])
    return {TERMS[0]: {"E": E, "nu": nu}, TERMS[1]: {"eta": E * float(np.exp(x[2]))}}


def values_on(clip: Clip, x: np.ndarray) -> Values:
    """Of numbers x, (3,), as runs on the clip's grid take them."""
    return values_of(clip.on_grid(x))


def softness(clip: Clip) -> np.ndarray:
    """Covariance of a base's numbers, (3, 3), because a finer grid is not yet tissue."""
    return np.diag((FINE_ENOUGH * clip.stiffer) ** 2)


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


def at_bound(x: np.ndarray, clip: Clip) -> tuple[str, ...]:
    """Names of numbers (3,) that lie at an end of what is tried."""
    ends = (x - LOW < 0.02 * SPREAD) | (HIGH - x < 0.02 * SPREAD)
    ends[2] |= longest_lag(x[0], clip) - x[2] < 0.02
    return tuple(name for name, end in zip(NAMES, ends, strict=True) if end)


def carried(carry, run: Run) -> np.ndarray:
    """Displacement of points [m], (K, T, 3)."""
    return np.stack([carry @ u.astype(float) for u in run.u], 1)


def displacement_gradient(prepared: Prepared, clip: Clip, run: Run) -> np.ndarray:
    """Derivative of displacement by rest position at the points, along each axis [1], (3, K, T, 3)."""
    step, result = STEP * clip.body.spacing, []
    for way in step * np.eye(3):
        ahead, behind = (carried(prepared.simulator.carry(clip.rest + by), run) for by in (way, -way))
        result.append((ahead - behind) / (2 * step))
    return np.stack(result)


def simulate(prepared: Prepared, clip: Clip, x: np.ndarray, memo: Memo, frames: int) -> tuple[Drive, Run]:
    """The base up to frame `frames`, exclusive; x: (3,), or with moments of release, (3 + R,)."""
    values, clip = values_on(clip, x), clip.opens(x[3:])
    what = ["base", clip.on_grid(x).tolist(), frames, *clip.kind]
    made = memo(what, lambda: vars(run_base(prepared, clip, values, last=frames - 1)))
    return base_drive(prepared, clip, values), Run(**made)


def tracks_of(clip: Clip, x: np.ndarray, memo: Memo, terms: tuple[str, str] = TERMS) -> np.ndarray:
    """Displacement of the points over the whole clip [m], (K, T, 3), with E, nu and eta of x."""
    prepared = clip.prepared(terms)
    values = dict(zip(terms, values_on(clip, x).values(), strict=True))

    def make() -> dict[str, np.ndarray]:
        run = run_base(prepared, clip, values, last=clip.frames - 1)
        return {"seen": carried(prepared.simulator.carry(clip.rest), run)}

    motion = [clip.motion.radius.tolist(), clip.motion.center_rest.tolist(), np.round(clip.motion.position, 9).tolist()]
    return memo(["tracks", terms, clip.on_grid(x).tolist(), *motion, *clip.kind], make)["seen"]


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


def base_drive(prepared: Prepared, clip: Clip, values: Values, safety: float = BOLD) -> Drive:
    """What carries the base along."""
    per_frame = prepared.per_frame(values, clip.fps, safety)
    return prepared.drive(clip.motion, values, fps=clip.fps, per_frame=per_frame, frames=clip.frames, late=clip.opening)


def run_base(prepared: Prepared, clip: Clip, values: Values, **span) -> Run:
    theta = prepared.theta(values)
    return boldly(lambda safety: follow(prepared.simulator, theta, base_drive(prepared, clip, values, safety), **span))


def boldly(run: Callable[[float], Run]) -> Run:
    """A run at a safety of the step, with BOLD first. Raises Breakdown where SAFETY breaks down too."""
    try:
        return run(BOLD)
    except Breakdown:
        return run(SAFETY)
