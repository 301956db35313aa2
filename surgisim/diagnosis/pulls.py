"""Measured forces as observations of a base, beside its points.

Where tissue is driven by displacements its points tell ratios of stiffnesses and time constants alone; a force tells a
modulus. A simulated one is that of the anchors' springs (`mpm/reaction.py`), near a run at x

    f(y) = E_y / E_x [f(x) + (nu_y - nu_x) df/dnu + (log lag_y - log lag_x) df/dlog lag]              [N]

since tissue that is carried along pulls in proportion to its modulus. Each anchor's force may be wrong by a share as a
whole, for its ball's radius and what a grid makes of it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from surgisim.diagnosis.base import base_drive, values_on
from surgisim.diagnosis.clip import Clip
from surgisim.mpm.reaction import reactions
from surgisim.mpm.setup import Prepared
from surgisim.mpm.simulator import Run

SHARE = 0.1
"""Standard deviation of how far an anchor's force is off as a whole [1]: a ball's pull goes with its radius, which is
known to about that (`nuisance`); chosen."""
EDGE = 1
"""Frames beside a closing or an opening in which no force counts: the moment is known to a frame."""
RATIO, LAG = 0.01, 0.3
"""Steps of nu and of log eta / E that slopes are read from."""


@dataclass(frozen=True)
class Pulls:
    """Forces over their noise near a run at `x`, N of them, and which anchor's each is."""

    x: np.ndarray
    """(3,)"""
    measured: np.ndarray
    """(N,)"""
    simulated: np.ndarray
    """At x, (N,)."""
    by_ratio: np.ndarray
    """Derivative by nu, (N,)."""
    by_lag: np.ndarray
    """Derivative by log eta / E, (N,)."""
    anchor: np.ndarray
    """(N,)"""
    sigma: np.ndarray
    """[N], (N,)"""

    def at(self, y: np.ndarray) -> np.ndarray:
        """Simulated with numbers y, (3 or more,), over their noise, (N,)."""
        off = y[:3] - self.x
        return np.exp(off[0]) * (self.simulated + off[1] * self.by_ratio + off[2] * self.by_lag)

    def left(self, y: np.ndarray) -> np.ndarray:
        """Measured less simulated, whitened, (N,)."""
        return self.white(self.measured - self.at(y))

    def cost(self, y: np.ndarray) -> float:
        """Chi square."""
        left = self.left(y)
        return float(left @ left)

    def slopes(self, y: np.ndarray) -> np.ndarray:
        """Derivative of whitened forces by the three numbers, (N, 3)."""
        times = np.exp(y[0] - self.x[0])
        return self.white(np.stack([self.at(y), times * self.by_ratio, times * self.by_lag], 1))

    def white(self, over_noise: np.ndarray) -> np.ndarray:
        """With each anchor's share taken into account, (N, ...): of covariance I + s^2 m m'.

        m: the simulated course, as large as the measured one. That itself would not do: it holds the noise, to which a
        course without any is never parallel, the less so the larger it is.
        """
        result = over_noise.astype(float).copy()
        for a in np.unique(self.anchor):
            mine = self.anchor == a
            way = self.simulated[mine]
            way = way * (way @ self.measured[mine]) / max(float(way @ way), 1e-30)
            size = float(way @ way)
            if size > 0:
                less = (1 - 1 / np.sqrt(1 + SHARE**2 * size)) / size
                result[mine] -= less * np.multiply.outer(way, way @ over_noise[mine])
        return result

    def told(self, y: np.ndarray) -> dict:
        """With numbers y: how many, the largest one measured and simulated there, RMS of what is left [N]."""
        k, simulated = int(np.abs(self.measured * self.sigma).argmax()), self.at(y)
        left = (self.measured - simulated) * self.sigma
        return {
            "count": len(left),
            "largest": float(self.measured[k] * self.sigma[k]),
            "simulated_there": float(simulated[k] * self.sigma[k]),
            "rms_left": float(np.sqrt((left**2).mean())),
            "unit": "N",
        }


def counted(clip: Clip) -> np.ndarray:
    """Which components of forces count as observations, (1 + J, T, 3) bool: where they are numbers, fitted, and each
    anchor holds as it did a frame before and after."""
    force, _ = clip.recording.forces.of_anchors(clip.frames)
    active = np.concatenate([np.ones((1, clip.frames), bool), clip.motion.active.astype(bool)])
    sure = np.ones_like(active)
    changed = np.flatnonzero((active[:, 1:] != active[:, :-1]).any(0))
    for frame in changed:
        # What one grip does as it lets go, what is held feels too.
        sure[:, max(frame - EDGE + 1, 0) : frame + EDGE + 1] = False
    return np.isfinite(force) & (active & sure & (np.arange(clip.frames) < clip.until))[..., None]


def pulls(
    clip: Clip, prepared: Prepared, x: np.ndarray, run: Run, run_with: Callable[[np.ndarray], Run]
) -> Pulls | None:
    """Near a run at x on the clip's grid; run_with: that with other numbers, (3,). None where nothing is measured."""
    if clip.recording.forces is None:
        return None
    force, sigma = clip.recording.forces.of_anchors(clip.frames)
    which = counted(clip)
    if not which.any():
        return None
    anchor = np.broadcast_to(np.arange(len(force))[:, None, None], force.shape)[which]
    noise = sigma[anchor]

    def simulated(y: np.ndarray, run: Run) -> np.ndarray:
        drive = base_drive(prepared, clip, values_on(clip, y))
        return reactions(prepared.simulator, drive, run)[: len(force)][which] / noise

    here = simulated(x, run)
    ways = (np.array([0.0, -RATIO, 0.0]), np.array([0.0, 0.0, -LAG]))
    by_ratio, by_lag = ((simulated(x + way, run_with(x + way)) - here) / way[way != 0][0] for way in ways)
    return Pulls(x[:3], force[which] / noise, here, by_ratio, by_lag, anchor, noise)
