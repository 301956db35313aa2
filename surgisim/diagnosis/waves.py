"""What points do under a rhythm of contraction: every period and phase as a mix of few columns.

A part of tissue pulls as max(0, sin x)^2, x = 2 pi t / period + phase - k . X, up to its second harmonic

    w(x) = 1/4 + 4 / (3 pi) sin x - 1/4 cos 2 x

so that all phases of a period are mixes of 1, sin x, cos x, sin 2 x and cos 2 x at phase zero.
"""

from collections.abc import Sequence

import numpy as np

from surgisim.diagnosis.hypothesis import SETS_IN, ease
from surgisim.diagnosis.look import Look

MEAN, ONE, TWO = 0.25, 4 / (3 * np.pi), -0.25
PARTS = 4
"""Columns a period, beside the one of the mean."""


def patterns(look: Look, axis: np.ndarray, wavelength: float) -> np.ndarray:
    """1, cos, sin, cos 2, sin 2 of how late the wave is at every particle, (5, P); 1 alone where all is in phase."""
    if np.isinf(wavelength):
        return np.ones((1, len(look.rest)))
    late = 2 * np.pi / wavelength * ((look.rest - look.rest.mean(0)) @ axis)
    return np.stack([np.ones_like(late), np.cos(late), np.sin(late), np.cos(2 * late), np.sin(2 * late)])


def columns(look: Look, states: np.ndarray, periods: Sequence[float], start: float) -> np.ndarray:
    """From what each pattern does, (M, S, K, 3) [m], to columns, (1 + PARTS len(periods), K, T, 3)."""
    time = look.clip.time[: look.clip.until]
    up = ease((time - start) / SETS_IN)
    courses = [[(0, up)]]
    for period in periods:
        x = 2 * np.pi / period * time
        for n in (1, 2):
            s, c = up * np.sin(n * x), up * np.cos(n * x)
            courses += [[(2 * n - 1, s), (2 * n, -c)], [(2 * n - 1, c), (2 * n, s)]]
    share = look.base.tangent.share
    if len(states) == 1:
        courses = [[(0, course) for _, course in parts[:1]] for parts in courses]
    found = [sum(np.tensordot(share * g[:, None], states[m], (1, 0)) for m, g in parts) for parts in courses]
    return np.stack(found).swapaxes(1, 2)


def mix(periods: Sequence[float], which: int, phase: float) -> np.ndarray:
    """A wave of one period and phase [rad] by those columns, (1 + PARTS len(periods),)."""
    found = np.zeros(1 + PARTS * len(periods))
    found[0] = MEAN
    at = 1 + PARTS * which
    # Columns are sin x, cos x, sin 2 x, cos 2 x without the phase.
    found[at : at + PARTS] = [
        ONE * np.cos(phase), ONE * np.sin(phase), -TWO * np.sin(2 * phase), TWO * np.cos(2 * phase),
    ]  # fmt: skip
    return found
