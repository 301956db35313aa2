"""How much pulled tissue comes at the camera for each bit it goes sideways.

A pulled spot drags its surroundings along nearly parallel lines: the change of depth has the same pattern as the
motion seen across the view, times one number a frame, the leaning. Brightness chooses the leaning: all values are
tried, because a slope to either side can look alike, and the choice may change only slowly in time. Where brightness
cannot tell, tissue is expected to be lifted off what it lies on, which is toward the camera.
"""

from collections.abc import Sequence

import numpy as np

from surgisim.perception.depth.shading import Lattice, shading

TRIED = np.round(np.arange(-4.0, 4.01, 0.2), 3)
"""Change of log depth per radian moved across the view."""
EXPECTED, SPREAD = -0.5, 0.6
DRIFT = 0.15
"""Spread of the leaning's change from one frame to the next."""
NOISE, ALIKE = 0.1, 20
"""Spread of log brightness; lattice pixels whose errors go together."""


def follow_leaning(lattice: Lattice, looks: Sequence) -> np.ndarray:
    """The most plausible leaning of each frame, (T,), by dynamic programming over `TRIED`."""
    prior = 0.5 * ((TRIED - EXPECTED) / SPREAD) ** 2 / len(looks)
    step = 0.5 * ((TRIED[:, None] - TRIED) / DRIFT) ** 2
    total, back = np.zeros(len(TRIED)), []
    for look in looks:
        ways = total[:, None] + step
        back.append(ways.argmin(0))
        total = ways.min(0) + _cost(lattice, look) + prior
    best = [int(total.argmin())]
    for came_from in back[:0:-1]:
        best.append(int(came_from[best[-1]]))
    return TRIED[best[::-1]]


def _cost(lattice: Lattice, look) -> np.ndarray:
    """Minus the log likelihood of each leaning; outliers count linearly."""
    concerned = look.weight * (look.moved > 0.25 * max(look.moved.max(), 1e-9))
    cost = np.zeros(len(TRIED))
    if look.moved.max() < 1e-3:
        return cost
    for i, leaning in enumerate(TRIED):
        rest = np.abs(look.light + shading(lattice, look.start + leaning * look.moved)) / NOISE
        cost[i] = (concerned * np.where(rest < 1, 0.5 * rest**2, rest - 0.5)).sum() / ALIKE
    return cost
