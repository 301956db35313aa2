"""What points do under a rhythm of contraction: every period and phase as a mix of few columns.

A part of tissue pulls as w(x) = sin(x / 2 d)^2 while 0 < x < 2 pi d, else not, x = 2 pi t / period + phase - k . X up
to whole turns, d the duty: for d = 1/2 it rests for half of every period, for d = 1 it never does. Up to its second
harmonic w is a mix of 1, sin x, cos x, sin 2 x and cos 2 x, and so are all its phases.
"""

from collections.abc import Sequence

import numpy as np

from surgisim.diagnosis.answers import Answers
from surgisim.diagnosis.hypothesis import SETS_IN, ease
from surgisim.diagnosis.look import Look

PARTS = 4
"""Columns a period, beside the one of the mean."""


def patterns(look: Look, axis: np.ndarray, wavelength: float) -> np.ndarray:
    """1, cos, sin, cos 2, sin 2 of how late the wave is at every particle, (5, P); 1 alone where all is in phase."""
    if np.isinf(wavelength):
        return np.ones((1, len(look.rest)))
    late = 2 * np.pi / wavelength * ((look.rest - look.rest.mean(0)) @ axis)
    return np.stack([np.ones_like(late), np.cos(late), np.sin(late), np.cos(2 * late), np.sin(2 * late)])


def columns(look: Look, states: np.ndarray, periods: Sequence[float], start: float) -> Answers:
    """From what each pattern does, (M, S, K, 3) [m], to columns, (1 + PARTS len(periods), K, T, 3)."""
    time = look.clip.time[: look.clip.until]
    up = ease((time - start) / SETS_IN)
    courses = np.zeros((1 + PARTS * len(periods), len(states), len(time)))
    courses[0, 0], at = up, 1
    for period in periods:
        x = 2 * np.pi / period * time
        for n in (1, 2):
            s, c = up * np.sin(n * x), up * np.cos(n * x)
            if len(states) == 1:
                courses[at : at + 2, 0] = s, c
            else:
                courses[at, [2 * n - 1, 2 * n]] = s, -c
                courses[at + 1, [2 * n - 1, 2 * n]] = c, s
            at += 2
    return Answers(states, look.base.tangent.share, courses)


def mix(periods: Sequence[float], which: int, phase: float, duty: float) -> np.ndarray:
    """A wave of one period, phase [rad] and duty by those columns, (1 + PARTS len(periods),)."""
    found = np.zeros(1 + PARTS * len(periods))
    found[0] = duty / 2
    at = 1 + PARTS * which
    # Columns are sin x, cos x, sin 2 x, cos 2 x without the phase.
    for n in (1, 2):
        part = 2 * harmonic(duty, n) * np.exp(1j * n * phase)
        found[at + 2 * n - 2 : at + 2 * n] = -part.imag, part.real
    return found


def harmonic(duty: float, n: int) -> complex:
    """c_n of w(x) = sum c_n exp(i n x)."""

    def whole(rate: float) -> complex:
        """Integral of exp(i rate x) over a pull."""
        end = 2 * np.pi * duty
        return end if abs(rate) < 1e-9 else (np.exp(1j * rate * end) - 1) / (1j * rate)

    return (whole(-n) - 0.5 * (whole(1 / duty - n) + whole(-1 / duty - n))) / (4 * np.pi)
