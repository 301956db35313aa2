"""What a simulation of a film gets wrong although its numbers are right, as an error that goes with the pull.

The surface's shape, the rim and the grip are guesses, so that the simulated displacement is a smooth field off, in
proportion to how far the tissue is carried: the same field in all frames of a pull, and another, which swings as the
tissue does, once that is let go: how far it swings for a pull is a guess, how fast and how long is not. A fit that took
its thousands of differences for independent would bend the tissue's numbers after it. Here each field is a Gaussian
process and is integrated out (Kennedy and O'Hagan, Bayesian calibration of computer models, JRSS B 63, 2001), so that
the shape of the motion tells as much as a few dozen numbers do, and the course in time, which a field does not bend,
all it can. Where the length of the grip's path is fitted, with a prior of its own, how far all of a pull goes is no
part of its field: it would be left open twice.
"""

from dataclasses import dataclass, field

import numpy as np

from surgisim.estimation.observation import Observation
from surgisim.estimation.whiten import inverse_root

SHARE = 0.15
"""Spread of the field, as a share of the local displacement."""
REACH = 0.5
"""Its length scale, as a share of how far the motion spreads."""
LEAST = 1e-3
"""Modes with less than this share of the first one's variance are left out."""
FLOOR = 0.05
"""Where tissue hardly moves, the field is this share of the farthest displacement's."""


@dataclass(frozen=True)
class ModelError:
    """The error's modes at the tracked points."""

    modes: np.ndarray
    """Times their standard deviations, as shares of `size`, of a pull and of what is let go, (2, K, Q)."""
    size: np.ndarray
    """Displacement, with the sign of its course, over the standard deviation of what is seen, (K, T, 3)."""
    free: np.ndarray
    """Frames in which no grip holds: they have a field of their own, (T,) bool."""
    independent: float
    """Share of the seen numbers that counts as independent."""
    kept: dict = field(default_factory=dict, compare=False)

    def whiten(self, r: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Residuals whose squares tell what the error leaves to tell, from weighted ones at `frames`, (K, F, 3).

        With noise of variance 1 / independent beside the error's B B^T, this is (1 + independent B B^T)^(-1/2) r.
        """
        out = r.copy()
        for k, mine in enumerate((~self.free[frames], self.free[frames])):
            if mine.any():
                out[:, mine] = self._whitened(r[:, mine], frames[mine], k)
        return out

    def _whitened(self, r: np.ndarray, frames: np.ndarray, field: int) -> np.ndarray:
        size, inner = self._of(frames, field)
        modes, out = self.modes[field], r.copy()
        for c in range(r.shape[-1]):
            told = modes.T @ (size[..., c] * r[..., c]).sum(1)
            out[..., c] -= size[..., c] * (modes @ (inner[c] @ told))[:, None]
        return out

    def _of(self, frames: np.ndarray, field: int) -> tuple[np.ndarray, list[np.ndarray]]:
        key = field, frames.tobytes()
        if key not in self.kept:
            size = np.sqrt(self.independent) * self.size[:, frames]
            modes, inner = self.modes[field], []
            for c in range(size.shape[-1]):
                gram = (modes * (size[..., c] ** 2).sum(1)[:, None]).T @ modes
                inner.append(inverse_root(gram))
            self.kept[key] = size, inner
        return self.kept[key]


def alike(rest: np.ndarray, far: np.ndarray) -> np.ndarray:
    """Correlation of the field at points `rest` [m], (K, 3), that go `far` [m], (K,), with that at others, (K, K)."""
    middle = np.average(rest, axis=0, weights=far**2)
    away = np.linalg.norm(rest - middle, axis=1)
    reach = REACH * np.sqrt(np.average(away**2, weights=far**2))
    apart = np.linalg.norm(rest[:, None] - rest[None], axis=-1)
    return np.exp(-0.5 * (apart / reach) ** 2)


def model_error(
    seen: Observation, course: np.ndarray, free: np.ndarray, independent: float, path_fitted: bool = True
) -> ModelError:
    """The error of a simulation that is compared with these points.

    course: share of the pull in every frame, (T,); free: whether no grip holds any more, (T,) bool. path_fitted:
    whether the length of the grip's path is fitted beside it.
    """
    used = seen.weight > 0
    moved = np.linalg.norm(seen.displacement * used, axis=-1)
    at = int(np.argmax(np.where(used.any(-1).mean(0) > 0.5, course, -1.0)))
    far = moved[:, at] / max(abs(course[at]), 1e-9)
    far = np.maximum(far, FLOOR * np.percentile(far, 99))
    value, vector = np.linalg.eigh(alike(seen.rest, far))
    chosen = value > LEAST * value[-1]
    modes = SHARE * vector[:, chosen] * np.sqrt(value[chosen])
    pulled = modes - np.average(modes, axis=0, weights=far**2) if path_fitted else modes
    return ModelError(
        np.stack([pulled, modes]), seen.weight * far[:, None, None] * course[None, :, None], free, independent
    )
