"""The most that any smooth residual could gain: a yardstick that names nothing."""

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
class Flexible:
    gain: float
    """Of chi square, less what it gains on nulls on average."""
    fitted: np.ndarray
    """[m], (K, T_fit, 3)."""


def flexible(clip: Clip, whiten: Whitener, space: Metric, z: np.ndarray, nulls: np.ndarray) -> Flexible:
    """A smooth field fitted to a whitened residual (N,), each coefficient with the same modest prior.

    nulls: residuals of nothing, (N, D), on which the same is done.
    """
    columns = _columns(clip, clip.until)
    white = whiten(columns).T.astype(np.float32)
    gram, shadow = space.gram(white, white), space.gram(white, np.concatenate([z[:, None], nulls], 1))
    unit = SIZE / np.sqrt(3 * PATTERNS)
    A = gram + np.eye(len(gram)) / unit**2
    x = np.linalg.solve(A, shadow)
    gains = (x * (2 * shadow - gram @ x)).sum(0)
    return Flexible(float(gains[0] - gains[1:].mean()), np.tensordot(x[:, 0], columns, 1))


def smooth_part(clip: Clip, residual: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Plain least squares of the same kind of field on residuals [m], (K, T, 3), where `seen`, (K, T)."""
    patterns = _patterns(clip)
    courses = _courses(residual.shape[1])
    design = np.einsum("km,bt->mbkt", patterns, courses).reshape(-1, *seen.shape)
    A = design[:, seen]
    normal = A @ A.T + 1e-6 * np.trace(A @ A.T) / len(A) * np.eye(len(A))
    return np.einsum("nc,nkt->ktc", np.linalg.solve(normal, A @ residual[seen]), design)


def _columns(clip: Clip, frames: int) -> np.ndarray:
    field = np.einsum("km,bt->mbkt", _patterns(clip), _courses(frames)).reshape(-1, len(clip.rest), frames)
    return np.concatenate([field[..., None] * e for e in np.eye(3)])


def _patterns(clip: Clip) -> np.ndarray:
    wide = WIDE * float(np.cbrt(clip.recording.mesh.volume)) / 0.036
    away = ((clip.rest[:, None] - clip.rest[None]) ** 2).sum(-1)
    _, axes = np.linalg.eigh(np.exp(-0.5 * away / wide**2))
    return axes[:, ::-1][:, :PATTERNS] * np.sqrt(len(away))


def _courses(frames: int) -> np.ndarray:
    count = min(COURSES, max(2, frames // 3))
    at = np.linspace(0, frames - 1, count)
    return np.stack([np.interp(np.arange(frames), at, e) for e in np.eye(count)])
