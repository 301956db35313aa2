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
from surgisim.diagnosis.metric import metric
from surgisim.diagnosis.noise import Whitener
from surgisim.diagnosis.tangent import Tangent, base_piola, tangent
from surgisim.mpm.grip import Drive
from surgisim.mpm.setup import Prepared, Values
from surgisim.mpm.simulator import Run

TERMS = ("neo_hookean_ciarlet", "newtonian")
START = np.array([np.log(3e3), 0.45, np.log(3e-3)])
"""log E [Pa], nu, log eta / E [s]."""
SPREAD = np.array([0.8, 0.03, 0.8])
LOW, HIGH = np.array([np.log(5e2), 0.30, np.log(3e-4)]), np.array([np.log(5e4), 0.485, np.log(3e-2)])
STEP = np.array([0.2, 0.01, 0.3])
SAFETY = 0.8
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


def fit_base(
    clip: Clip, whiten: Whitener, nuisances: np.ndarray, memo: Memo, *, rounds: int = 1, inner_steps: int = 3,
    say: Callable[[str], None] = lambda text: None, extra: np.ndarray | None = None,
) -> Base:  # fmt: skip
    """Least squares over E, nu and eta.

    nuisances: whitened at one standard deviation, (N, M), but for those that depend on the run. extra: what is added to the simulated tracks [m], (K, T_fit, 3).
    """
    x, until = START.copy(), clip.until
    prepared = clip.prepared(TERMS)
    carry = prepared.simulator.carry(clip.rest)
    space = metric(nuisances)
    target = clip.moved[:, :until] - (0 if extra is None else extra)
    for iteration in range(rounds + 1):
        last = iteration == rounds
        say(f"base, run {iteration + 1}: E {np.exp(x[0]):.0f} Pa, nu {x[1]:.3f}, eta {np.exp(x[0] + x[2]):.2f} Pa s")
        drive, run = simulate(prepared, clip, x, memo, clip.frames if last else until)
        simulated = carried(carry, run)
        near = tangent(prepared, values_of(x), drive, run, clip.rest, until)
        slopes = np.zeros((3, *target.shape))
        slopes[1] = _by_poisson(prepared, near, x)
        begun, y, now = x.copy(), x.copy(), simulated[:, :until].copy()
        for inner in range(1 if last else inner_steps):
            slopes[[0, 2]] = _by_rates(clip, prepared, y, run, carry, now, memo, begun)
            J = whiten(slopes).T
            normal = space.gram(J, J) + np.diag(1 / SPREAD**2)
            if last:
                break
            step = np.linalg.solve(normal, space.gram(J, whiten(target - now)[:, None])[:, 0] - (y - START) / SPREAD**2)
            y_new = np.clip(y + np.clip(step, -1.2 * SPREAD, 1.2 * SPREAD), LOW, HIGH)
            if inner + 1 < inner_steps:
                now = simulated[:, :until] + (y_new[1] - x[1]) * slopes[1][:, :]
                first, end = _window(clip)
                seen = _short(clip, prepared, np.array([y_new[0], x[1], y_new[2]]), run, carry, first, end)
                now[:, first + 1 : end + 1] = seen + (y_new[1] - x[1]) * slopes[1][:, first + 1 : end + 1]
            y = y_new
        x = y if not last else x
    spread = np.sqrt(np.diag(np.linalg.inv(normal)))
    return Base(x, prepared, drive, run, simulated, near, slopes * SPREAD[:, None, None, None], spread)


def carried(carry, run: Run) -> np.ndarray:
    """Displacement of points [m], (K, T, 3)."""
    return np.stack([carry @ u.astype(float) for u in run.u], 1)


def simulate(prepared: Prepared, clip: Clip, x: np.ndarray, memo: Memo, frames: int) -> tuple[Drive, Run]:
    """The base up to frame `frames`, exclusive."""
    values = values_of(x)
    drive = base_drive(prepared, clip, values)
    made = memo(
        ["base", x.tolist(), frames],
        lambda: vars(prepared.simulator.run(prepared.theta(values), drive, last=frames - 1)),
    )
    return drive, Run(**made)


def base_drive(prepared: Prepared, clip: Clip, values: Values) -> Drive:
    per_frame = prepared.per_frame(values, clip.fps, SAFETY)
    return prepared.drive(clip.motion, values, fps=clip.fps, per_frame=per_frame, frames=clip.frames)


def _by_poisson(prepared, near: Tangent, x) -> np.ndarray:
    """Derivative of the points' displacement by nu [m], (K, T_fit, 3)."""
    values, more = values_of(x), values_of(x - [0, 1e-4, 0])
    loads = []
    for frame in near.frames:
        F = near.gradient(frame)
        loads.append(near.of_stress((base_piola(prepared, values, F) - base_piola(prepared, more, F)) / 1e-4))
    return near.over_time(near.at_states(np.stack(loads)[:, None])[:, 0])


def _by_rates(clip, prepared, x, run, carry, now, memo, begun) -> np.ndarray:
    """The same by log E and log eta / E, (2, K, T_fit, 3), from short runs that begin in states of `run`."""
    result, (first, last) = np.zeros((2, *now.shape)), _window(clip)
    y = np.array([x[0], begun[1], x[2]])

    def seen(k: int | None) -> np.ndarray:
        shifted = y if k is None else y + STEP * np.eye(3)[k]
        what = ["short", begun.tolist(), shifted.tolist(), first, last]
        return memo(what, lambda: {"seen": _short(clip, prepared, shifted, run, carry, first, last)})["seen"]

    middle = seen(None)
    for n, k in enumerate((0, 2)):
        result[n, :, first + 1 : last + 1] = (seen(k) - middle) / STEP[k]
    return result


def _short(clip, prepared, x, run, carry, first, last) -> np.ndarray:
    values = values_of(x)
    drive = base_drive(prepared, clip, values)
    begin = run.state(first) if first else None
    moved = prepared.simulator.run(prepared.theta(values), drive, begin=begin, first=first, last=last)
    return carried(carry, moved)[:, 1:]


def _window(clip: Clip) -> tuple[int, int]:
    """From just before the first release for a while; everything where nothing is released."""
    active = clip.motion.active[:, : clip.until] if len(clip.motion.active) else np.zeros((0, clip.until), bool)
    ends = [int(np.flatnonzero(a)[-1]) for a in active if a.any()]
    ends = [e for e in ends if e < clip.until - 3]
    if not ends:
        return 0, clip.until - 1
    return max(min(ends) - 1, 0), min(clip.until - 1, min(ends) + round(AFTER * clip.fps))
