"""Time courses of laws without a name: functions of time alone, so that they go on beyond what was fitted.

    c(t) = w(t) - w(0),   w(t) = S((t - onset - rise / 2) / rise) S((end - t) / EDGE) exp(-<t - onset> / fade) r(t)
    r(t) = 1 + rhythm (sin(2 pi t / period + phase) - 1)
    S(x) = (1 + tanh(STEEP x)) / 2,   <x> = x^2 / (x + EDGE) for x > 0, else 0

It comes within `rise` [s] of its onset and stays, unless it fades or ends; with rhythm 1 it is periodic. What is there
in the first frame already is in equilibrium there, hence - w(0).
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param

EDGE = 0.05
"""How fast it ends, and how gradually it begins to fade [s]."""
STEEP = 3.75
"""With it S is as steep in the middle as the smoothest polynomial of degree five that rises within one [1]."""
NEVER, LASTING = 59.0, 1e6
"""An end after every clip, and a time of fading so long that none does [s]."""
PARAMS = {
    "onset": Param("s", low=-1e2, high=6e1, default=0.2, logarithmic=False),
    "rise": Param("s", low=0.05, high=2e1, default=0.2),
    "end": Param("s", low=0.0, high=6e1, default=NEVER, logarithmic=False),
    "fade": Param("s", low=0.05, high=LASTING, default=LASTING),
    "rhythm": Param("1", low=0.0, high=1.0, default=0.0, logarithmic=False),
    "period": Param("s", low=0.2, high=6e1, default=2.0),
    "phase": Param("rad", low=-np.pi, high=np.pi, default=0.0, logarithmic=False),
}
"""In the order in which a law's columns have them."""
EXAMPLE = {"onset": 0.3, "rise": 0.4, "fade": 3.0, "rhythm": 0.3, "phase": 0.4}
"""Numbers at which every part of it counts."""


@wp.func
def _whole(theta: Any, first: int, t: Any):
    one, half, steep = theta.dtype(1.0), theta.dtype(0.5), theta.dtype(STEEP)
    onset, rise = theta[first], theta[first + 1]
    risen = half * (one + wp.tanh(steep * (t - onset - half * rise) / rise))
    left = half * (one + wp.tanh(steep * (theta[first + 2] - t) / theta.dtype(EDGE)))
    since = wp.max(t - onset, theta.dtype(0.0))
    fades = wp.exp(-since * since / (since + theta.dtype(EDGE)) / theta[first + 3])
    turn = theta.dtype(2.0) * theta.dtype(wp.pi) * t / theta[first + 5] + theta[first + 6]
    return risen * left * fades * (one + theta[first + 4] * (wp.sin(turn) - one))


@wp.func
def course(theta: Any, first: int, t: Any):
    """c(t), its seven numbers in theta from column `first` on."""
    return _whole(theta, first, t) - _whole(theta, first, t - t)


def at(t, onset, rise, end, fade, rhythm, period, phase):
    """c(t) in float64."""
    now, first = (_whole_at(s, onset, rise, end, fade, rhythm, period, phase) for s in (np.asarray(t, float), 0.0))
    return now - first


def _whole_at(t, onset, rise, end, fade, rhythm, period, phase):
    risen = 0.5 * (1 + np.tanh(STEEP * (t - onset - 0.5 * rise) / rise))
    left = 0.5 * (1 + np.tanh(STEEP * (end - t) / EDGE))
    since = np.maximum(t - onset, 0.0)
    fades = np.exp(-(since**2) / (since + EDGE) / fade)
    return risen * left * fades * (1 + rhythm * (np.sin(2 * np.pi * t / period + phase) - 1))
