"""Strike one mode of a rod, and read frequency and decay off its amplitude over time."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from surgisim.verification.rod import Rod, share

SAMPLES = 40
"""Samples a period."""


@dataclass(frozen=True)
class Vibration:
    """q(t) = A exp(-decay t) cos(omega t - phase), fitted."""

    amplitude: float
    omega: float
    """[rad/s]"""
    decay: float
    """[1/s]"""
    phase: float
    rest: float
    """RMS of what the fit leaves, as a share of A."""

    @property
    def frequency(self) -> float:
        """[Hz]"""
        return self.omega / (2 * np.pi)

    @property
    def decrement(self) -> float:
        """Logarithm of the ratio of two maxima one period apart."""
        return 2 * np.pi * self.decay / self.omega


def vibration(time: np.ndarray, q: np.ndarray, omega: float, *, about: bool = False) -> Vibration:
    """Least-squares fit of one decaying cosine to q (T,) at `time` [s]; `omega` is a first guess [rad/s], to 20 %.

    about: whether it swings about an unknown constant instead of zero.
    """
    scale = np.abs(q).max()

    def columns(rate, decay):
        envelope = np.exp(-decay * time)
        cosine, sine = envelope * np.cos(rate * time), envelope * np.sin(rate * time)
        return np.stack([cosine, sine, np.ones_like(time)] if about else [cosine, sine], 1)

    def residual(x):
        basis = columns(*x)
        return (basis @ np.linalg.lstsq(basis, q, rcond=None)[0] - q) / scale

    # The sum of squares has many minima in the frequency: the best of a fine row of guesses leads to the right one.
    span = time[-1] - time[0]
    guesses = omega * np.linspace(0.8, 1.2, max(9, int(0.4 * omega * span / 0.8) | 1))
    begin = min(guesses, key=lambda g: np.sum(residual((g, 0.0)) ** 2))
    found = least_squares(residual, (begin, 0.0), x_scale=(omega, max(1 / span, 1e-3)), xtol=1e-14, ftol=1e-14)
    rate, decay = found.x
    a, b = np.linalg.lstsq(columns(rate, decay), q, rcond=None)[0][:2]
    size = float(np.hypot(a, b))
    rest = float(np.sqrt(np.mean(found.fun**2)) * scale / size)
    return Vibration(size, float(rate), float(decay), float(np.arctan2(b, a)), rest)


def strike(
    rod: Rod, mode: np.ndarray, frequency: float, *, amplitude: float, periods: float = 3.0, refine: int = 1
) -> tuple[np.ndarray, np.ndarray, float]:
    """Time [s] (T,), share of `mode` (A, 3) in the motion (T,), and the step [s], of a rod struck from rest.

    frequency: what is expected [Hz]; amplitude: share that is expected; the step is the default one over `refine`.
    """
    step = rod.step / refine
    every = max(1, int(1 / (frequency * SAMPLES * step)))
    samples = int(np.ceil(periods / (frequency * step * every)))
    speed = amplitude * 2 * np.pi * frequency * mode
    out = rod.run(step, every, samples, begin=(np.zeros_like(speed), speed))
    return np.arange(samples + 1) * every * step, share(rod, out.u, mode), step
