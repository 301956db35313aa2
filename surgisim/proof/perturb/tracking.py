"""Noisier tracks, and the same tissue tracked once more."""

import dataclasses
import math

import numpy as np

from surgisim.phantom import nuisance
from surgisim.problem import Problem
from surgisim.recordings.recording import Recording
from surgisim.recordings.ways import turned


def noisier(recording: Recording, rng: np.random.Generator, true: np.ndarray | None, factor: float) -> Recording:
    """Errors `factor` times as large: those that there are, where the true paths [m], (K, T, 3), are known.

    Where they are not, independent errors are added, of the size that makes the sum so large.
    """
    if true is not None:
        points = true + factor * (recording.points - true)
    else:
        added = math.sqrt(factor**2 - 1) * recording.noise[:, None]
        added = added * rng.standard_normal(recording.points.shape)
        points = recording.points + turned(added, recording.ways, back=True)
    return dataclasses.replace(recording, points=points.astype(np.float32), sigma=factor * recording.sigma)


def tracked_again(recording: Recording, rng: np.random.Generator, true: np.ndarray | None) -> Recording:
    """The phantom's tracker once more on the same true paths [m], (K, T, 3). Raises Problem where there are none."""
    if true is None:
        raise Problem(f"recording {recording.name}: new noise needs its true paths. Pass truth.npz.")
    seen = nuisance.seen(true[:, 0], true, float(recording.sigma.mean()), rng)
    points = np.where(recording.visible[..., None], seen, np.nan)
    return dataclasses.replace(recording, points=points.astype(np.float32))
