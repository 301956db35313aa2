"""Forces on nodes that need no stress: given ones, springs with slack, drag."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit

from surgisim.phantom.forces import FAST
from surgisim.phantom.timeline import ease


@dataclass(frozen=True)
class Load:
    """A fixed pattern that swells and fades."""

    pattern: np.ndarray
    """[N], (N, 3)."""
    amount: Callable[[float], float]
    """Factor at a time [s]."""

    def add(self, x, v, t, dt, force):
        factor = self.amount(t)
        if factor != 0.0:
            force += factor * self.pattern


@dataclass(frozen=True)
class Springs:
    """From nodes to places: pulling only, once longer than at rest by `slack`."""

    nodes: np.ndarray
    """(Q,)."""
    stiffness: np.ndarray
    """[N/m], (Q,)."""
    feet: np.ndarray
    """Other ends [m], (Q, 3)."""
    length: np.ndarray
    """At rest [m], (Q,)."""
    slack: float
    """[m]."""
    shift: Callable[[float], np.ndarray]
    """Of the feet [m], (3,), at a time [s]."""
    amount: Callable[[float], float]
    """Factor of the stiffness at a time [s]."""

    def add(self, x, v, t, dt, force):
        factor = self.amount(t)
        if factor != 0.0:
            feet = self.feet + self.shift(t)
            _pull(x, self.nodes, factor * self.stiffness, feet, self.length, self.slack, force)


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _pull(x, nodes, stiffness, feet, length, slack, force):
    for q in range(len(nodes)):
        n = nodes[q]
        away = 0.0
        for i in range(3):
            away += (feet[q, i] - x[n, i]) ** 2
        away = np.sqrt(away)
        over = away - length[q] - slack
        if over > 0.0:
            for i in range(3):
                force[n, i] += stiffness[q] * over * (feet[q, i] - x[n, i]) / away


def always(t: float) -> float:
    return 1.0


def onset(at: float, rise: float) -> Callable[[float], float]:
    """0 before a time [s], 1 from `rise` [s] after it."""
    return lambda t: float(ease((t - at) / rise))


def window(begin: float, end: float, rise: float) -> Callable[[float], float]:
    """1 between two times [s], 0 outside, with edges of `rise` [s] within."""
    return lambda t: float(ease((t - begin) / rise) * ease((end - t) / rise))
