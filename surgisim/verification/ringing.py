"""Frequency and decay of a body that rings down while it slowly settles.

    y(t) = exp(-decay t) (a cos w t + b sin w t) + midline(t),   midline(t) = c + d exp(-t / 0.2 s) + e exp(-t / 1 s)

The midline takes up creep, which would otherwise bend the envelope.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

CREEP = (0.2, 1.0)
"""[s]"""


@dataclass(frozen=True)
class Ringing:
    frequency: float
    """[Hz]"""
    decay: float
    """[1/s]"""
    amplitude: float
    """At the window's begin, in the unit of y."""
    slow: tuple[float, ...]
    """c, d, e: the midline's weights, in the unit of y."""
    taus: tuple[float, ...]
    """Its time constants [s]."""
    rest: float
    """RMS of what the fit leaves, in the unit of y."""

    @property
    def loss(self) -> float:
        """Loss factor of the mode: twice the damping ratio."""
        return self.decay / (np.pi * self.frequency)

    def midline(self, t: np.ndarray) -> np.ndarray:
        """Around what y swings at times t [s], (T,)."""
        return _slow(t, self.taus) @ np.array(self.slow)


def ringing(
    y: np.ndarray, fps: float, *, begin: float, end: float, frequency: float, taus: tuple[float, ...] = CREEP
) -> Ringing:
    """Fit of y (T,) between `begin` and `end` [s]; `frequency` is a first guess [Hz], to 15 %."""
    first, last = round(begin * fps), min(round(end * fps), len(y) - 1)
    y = y[first : last + 1]
    t = np.arange(len(y)) / fps
    slow = _slow(t + first / fps, taus)

    def columns(p):
        phase = 2 * np.pi * p[0] * t
        envelope = np.exp(-p[1] * t)[:, None]
        return np.concatenate([envelope * np.stack([np.cos(phase), np.sin(phase)], 1), slow], 1)

    def weights(p):
        return np.linalg.lstsq(columns(p), y, rcond=None)[0]

    def residual(p):
        return (columns(p) @ weights(p) - y) / np.ptp(y)

    guesses = frequency * np.linspace(0.85, 1.15, 13)
    nearest = min(guesses, key=lambda f: np.sum(residual((f, 2.0)) ** 2))
    found = least_squares(residual, (nearest, 2.0), x_scale=(frequency, 1.0), xtol=1e-12, ftol=1e-12)
    a, b, *midline = weights(found.x).tolist()
    rest = float(np.sqrt(np.mean(found.fun**2)) * np.ptp(y))
    return Ringing(*map(float, found.x), float(np.hypot(a, b)), tuple(midline), taus, rest)


def _slow(t: np.ndarray, taus: tuple[float, ...]) -> np.ndarray:
    return np.stack([np.ones_like(t), *(np.exp(-t / tau) for tau in taus)], 1)
