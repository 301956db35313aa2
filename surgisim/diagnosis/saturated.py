"""The saturated model: the most that any smooth residual could gain, a yardstick that names nothing."""

from dataclasses import dataclass

import numpy as np

from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.metric import Metric
from surgisim.diagnosis.noise import Whitener

PATTERNS = 14
"""Smooth patterns over the tissue."""
COURSES = 14
"""Smooth courses over the fitted time."""
WIDE = 0.012
"""Distance over which patterns are smooth [m], for a body of 36 mm."""
SIZE = 6e-4
"""RMS size expected of the whole [m]."""


@dataclass(frozen=True)
class SmoothFit:
    """A smooth field, fitted."""

    gain: float
    """Of chi square, less what it gains on nulls on average."""
    fitted: np.ndarray
    """[m], (K, T_fit, 3)."""
    slack: float = 0.0
    """What all but 5 % of the nulls gain, beyond that average."""


@dataclass(frozen=True)
class Saturated:
    """Smooth fields, each coefficient with the same modest prior."""

    field: np.ndarray
    """Of one component, (M, K, T_fit)."""
    white: np.ndarray
    """Along each axis, whitened, (N, 3 M) float32."""
    space: Metric
    gram: np.ndarray
    """(3 M, 3 M)"""
    by_chance: float
    """Of chi square, gained on nulls on average."""
    slack: float
    """What all but 5 % of the nulls gain, beyond that."""

    def fit(self, z: np.ndarray) -> SmoothFit:
        """To a whitened residual (N,)."""
        x, gains = _fitted(self.gram, _shadow(self.white, self.space, z[:, None]))
        parts = x.reshape(3, len(self.field))
        return SmoothFit(
            float(gains[0]) - self.by_chance, np.einsum("em,mkt->kte", parts, self.field, optimize=True), self.slack
        )


def saturated(clip: Clip, whiten: Whitener, space: Metric, nulls: np.ndarray) -> Saturated:
    """The fields of a clip; nulls: residuals of nothing, (N, D)."""
    field = np.einsum("km,bt->mbkt", _patterns(clip), _courses(clip.until)).reshape(-1, len(clip.rest), clip.until)
    white = whiten(np.concatenate([field[..., None] * e for e in np.eye(3)])).T.astype(np.float32)
    gram = space.gram(white, white)
    _, gains = _fitted(gram, _shadow(white, space, nulls))
    by_chance = float(gains.mean())
    return Saturated(field, white, space, gram, by_chance, float(np.quantile(gains, 0.95)) - by_chance)


def _shadow(white: np.ndarray, space: Metric, residuals: np.ndarray) -> np.ndarray:
    """Products with residuals (N, D) under the metric, (3 M, D)."""
    return (white.T @ space.cleared(residuals).astype(np.float32)).astype(float)


def _fitted(gram: np.ndarray, shadow: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (3 M, C) and what they gain, (C,)."""
    unit = SIZE / np.sqrt(3 * PATTERNS)
    x = np.linalg.solve(gram + np.eye(len(gram)) / unit**2, shadow)
    return x, (x * (2 * shadow - gram @ x)).sum(0)


def smooth_part(clip: Clip, residual: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Plain least squares of the same kind of field on residuals [m], (K, T, 3), where `seen`, (K, T)."""
    patterns = _patterns(clip)
    courses = _courses(residual.shape[1])
    design = np.einsum("km,bt->mbkt", patterns, courses).reshape(-1, *seen.shape)
    A = design[:, seen]
    normal = A @ A.T + 1e-6 * np.trace(A @ A.T) / len(A) * np.eye(len(A))
    return np.einsum("nc,nkt->ktc", np.linalg.solve(normal, A @ residual[seen]), design)


def _patterns(clip: Clip) -> np.ndarray:
    wide = WIDE * float(np.cbrt(clip.recording.mesh.volume)) / 0.036
    away = ((clip.rest[:, None] - clip.rest[None]) ** 2).sum(-1)
    _, axes = np.linalg.eigh(np.exp(-0.5 * away / wide**2))
    return axes[:, ::-1][:, :PATTERNS] * np.sqrt(len(away))


def _courses(frames: int) -> np.ndarray:
    count = min(COURSES, max(2, frames // 3))
    at = np.linspace(0, frames - 1, count)
    return np.stack([np.interp(np.arange(frames), at, e) for e in np.eye(count)])
