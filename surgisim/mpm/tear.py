"""Where tissue is not joined to what lies beside it, through all of its depth."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np


class Severing(Protocol):
    """What lies between tissue that does not hang together."""

    def crosses(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Whether the segment from a to b [m], (..., 3) each, passes through it, (...)."""
        ...


@dataclass(frozen=True)
class Tear:
    """Walls along the view over segments across it."""

    walls: np.ndarray
    """Both ends of each, camera frame x and y at rest [m], (K, 2, 2)."""

    def crosses(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Whether the segment from a to b [m], (..., 3) each, passes through a wall, (...)."""
        across = np.zeros(np.broadcast_shapes(a.shape, b.shape)[:-1], bool)
        if not len(self.walls):
            return across
        a, b = (np.broadcast_to(p, (*across.shape, 3))[..., :2] for p in (a, b))
        low, high = self.walls.min((0, 1)), self.walls.max((0, 1))
        near = ((np.minimum(a, b) <= high) & (np.maximum(a, b) >= low)).all(-1)
        a, b = a[near], b[near]
        hit = np.zeros(len(a), bool)
        for begin, end in self.walls:
            sides = [_side(begin, end, p) for p in (a, b)], [_side(a, b, p) for p in (begin, end)]
            hit |= (sides[0][0] != sides[0][1]) & (sides[1][0] != sides[1][1])
        across[near] = hit
        return across


@dataclass(frozen=True)
class Either:
    """Several at once."""

    parts: tuple[Severing, ...]

    def crosses(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Whether the segment from a to b [m], (..., 3) each, passes through any of them, (...)."""
        return np.any([part.crosses(a, b) for part in self.parts], axis=0)


def severed(*parts: Severing | None) -> Severing | None:
    """All that severs a body as one; None where nothing does."""
    there = tuple(part for part in parts if part is not None)
    return Either(there) if len(there) > 1 else next(iter(there), None)


def _side(begin: np.ndarray, end: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Whether points lie left of the line from begin to end, (..., 2) each, (...)."""
    along, to = end - begin, point - begin
    return along[..., 0] * to[..., 1] - along[..., 1] * to[..., 0] > 0
