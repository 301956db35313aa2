"""How surely somebody who knows law, base, solver and noise would see what is hidden.

The log evidence of a change d of the paths over nothing is half of d^T Q d: Q is the inverse of the covariance C of
what tracker and camera add, without the directions that could as well be the base, the timing of tracker and grips, or
how firmly and how widely they hold. C is the one that the noise was drawn with (seen.py): neighbours err alike, for
some frames on end, and a camera moves all points, so that a hundred points say much less than a hundred times one. A
ratio of RMS would not compare between points, frames and families.
"""

import numpy as np
from scipy.sparse.linalg import LinearOperator, cg

from surgisim.phantom.families.seen import Seeing, moves
from surgisim.problem import Problem

CLOSE = 1e-4
"""Relative residual at which C x = d counts as solved [1]."""
UNKNOWN = 100.0
"""Variance of each point's constant, over sigma^2 [1]: so large that only what moves counts."""


class Oracle:
    """For points at `rest` [m], (K, 3), over a whole clip, in samples `seen`, (K, T), that may be fitted, beside
    directions `base` [m], each (K, T, 3)."""

    def __init__(self, rest: np.ndarray, seen: np.ndarray, seeing: Seeing, base: list[np.ndarray]):
        self._seen, self._sigma = seen, seeing.sigma
        self._space, self._time = seeing.between(rest), seeing.over_time(seen.shape[1])
        self._moves, self._courses = moves(rest, rest.mean(0)), seeing.courses(seen.shape[1])
        found = [d for d in map(self._of_seen, base) if np.linalg.norm(d) > 1e-9]
        self._base = np.array([d / np.linalg.norm(d) for d in found]).reshape(len(found), 3 * seen.sum())
        self._solved = np.array([self._weighed(d) for d in self._base]).reshape(self._base.shape)

    def evidence(self, change: np.ndarray) -> float:
        """Log evidence [1] of a change of the paths [m], (K, T, 3). Raises Problem where C cannot be solved."""
        d = self._of_seen(change)
        aside = self._solved @ d
        known = aside @ np.linalg.lstsq(self._base @ self._solved.T, aside, rcond=1e-8)[0]
        return 0.5 * float(d @ self._weighed(d) - known)

    def _of_seen(self, change: np.ndarray) -> np.ndarray:
        return (change / self._sigma)[self._seen].ravel()

    def _weighed(self, d: np.ndarray) -> np.ndarray:
        """Inverse of C times a field over sigma."""
        found, failed = cg(LinearOperator((len(d), len(d)), self.covered, dtype=float), d, rtol=CLOSE)
        if failed:
            raise Problem("phantom: the covariance of the tracks' noise is too close to singular to weigh an effect.")
        return found

    def covered(self, d: np.ndarray) -> np.ndarray:
        """C times a field over sigma in the samples that are seen, (N,)."""
        field = np.zeros((*self._seen.shape, 3))
        field[self._seen] = d.reshape(-1, 3)
        result = np.einsum("kl,lti->kti", self._space, np.einsum("ts,ksi->kti", self._time, field))
        result += UNKNOWN * field.sum(1, keepdims=True)
        courses = self._courses @ (self._courses.T @ np.einsum("mki,kti->tm", self._moves, field))
        result += np.einsum("tm,mki->kti", courses, self._moves)
        return result[self._seen].ravel()
