"""Directions of one kind in which a residual may lie."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Group:
    """Directions of one kind."""

    name: str
    columns: np.ndarray
    """At one prior standard deviation [m], (C, K, T, 3)."""
    values: tuple[tuple[str, float, str], ...] = ()
    """Name, prior standard deviation and unit of each direction that a reader would ask for, in order."""

    def wider(self, times: float | np.ndarray) -> "Group":
        """All directions some times as wide, or each, (C,)."""
        each = np.broadcast_to(times, len(self.columns))
        named = tuple((name, float(t) * sd, unit) for (name, sd, unit), t in zip(self.values, each, strict=False))
        return Group(self.name, each[:, None, None, None] * self.columns, named)


def none(name: str, like: np.ndarray) -> Group:
    """A kind without directions; like: a displacement, (K, T, 3)."""
    return Group(name, np.zeros((0, *like.shape)))
