"""Least squares with noise that is white but for a few directions: nuisances, and what the simulator gets wrong.

With whitened columns U scaled to their prior standard deviations, the covariance is 1 + U U^T, and (Woodbury)

    <a, b> = a^T (1 + U U^T)^-1 b = a^T b - (U^T a)^T (1 + U^T U)^-1 (U^T b).

A nuisance may be ten thousand times the noise, and what is left of it is told from the noise: its products are taken in
double precision. Those of all others, and the columns themselves, are single.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.linalg.blas import dsyrk

ROWS = 4096
"""Rows that are taken to double precision at once."""
LARGE = 100.0
"""Length of a column, in standard deviations of noise, beyond which its products are taken in double precision: single
ones are off by its square times 6e-8."""


@dataclass(frozen=True)
class Metric:
    columns: np.ndarray
    """U, (N, M) float32."""
    own: np.ndarray
    """U^T U, (M, M)."""
    factor: tuple
    """Of 1 + U^T U, as `scipy.linalg.cho_factor` has it."""

    @property
    def log_det(self) -> float:
        """log determinant of the covariance."""
        return float(2 * np.log(np.diag(self.factor[0])).sum())

    @cached_property
    def large(self) -> np.ndarray:
        """Which columns are LARGE, (L,)."""
        return np.flatnonzero(np.diag(self.own) > LARGE**2)

    @cached_property
    def _exactly(self) -> np.ndarray:
        """Those columns, (N, L)."""
        return self.columns[:, self.large].astype(float)

    @cached_property
    def _among_large(self) -> tuple:
        """As `factor`, of those alone."""
        return cho_factor(np.eye(len(self.large)) + self.own[np.ix_(self.large, self.large)])

    def seen_through(self, vectors: np.ndarray) -> np.ndarray:
        """U^T of vectors (N,) or (N, C)."""
        mine = self._exactly.T @ vectors
        # Without what the large ones could be of them, vectors are small as well.
        share = cho_solve(self._among_large, mine)
        rest = vectors - self._exactly @ share
        found = self.columns.T @ rest.astype(np.float32) + self.own[:, self.large] @ share
        found[self.large] = mine
        return found

    def gram(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """<a, b> of columns (N, C) and (N, D)."""
        mine = self.seen_through(a)
        return products(a, b) - mine.T @ cho_solve(self.factor, mine if b is a else self.seen_through(b))

    def cleared(self, vectors: np.ndarray) -> np.ndarray:
        """(1 + U U^T)^-1 of vectors (N,) or (N, C): their plain products with others are those of `gram`."""
        return vectors - self.explained(vectors)

    def likely(self, vectors: np.ndarray) -> np.ndarray:
        """Most likely values of the directions for vectors (N,) or (N, C), in prior standard deviations, (M, ...)."""
        return cho_solve(self.factor, self.seen_through(vectors))

    def explained(self, vectors: np.ndarray) -> np.ndarray:
        """The part of vectors (N,) or (N, C) that the directions take: nuisances at their most likely values."""
        likely = self.likely(vectors)
        small = likely.astype(np.float32)
        small[self.large] = 0.0
        return self.columns @ small + self._exactly @ likely[self.large]

    def draw(self, rng: np.random.Generator, count: int, project) -> np.ndarray:
        """Residuals of nothing but noise and nuisance, (N, count); `project` takes out each point's constant."""
        white = project(rng.standard_normal((len(self.columns), count)).astype(np.float32))
        return white + self.columns @ rng.standard_normal((self.columns.shape[1], count)).astype(np.float32)


def metric(columns: np.ndarray) -> Metric:
    """columns: whitened and scaled to one prior standard deviation, (N, M)."""
    U = np.ascontiguousarray(columns if columns.shape[1] else np.zeros((len(columns), 1)), np.float32)
    half = np.zeros((U.shape[1], U.shape[1]), order="F")
    for rows in np.array_split(U, len(U) // ROWS + 1):
        half = dsyrk(1.0, rows.T.astype(float, order="F"), beta=1.0, c=half, overwrite_c=True)
    own = np.triu(half) + np.triu(half, 1).T
    return Metric(U, own, cho_factor(np.eye(len(own)) + own))


def products(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Of columns (N, C) and (N, D) with each other in double precision, (C, D)."""
    rows = len(a) // ROWS + 1
    parts = zip(np.array_split(a, rows), np.array_split(b, rows), strict=True)
    return sum(one.T.astype(float) @ other.astype(float) for one, other in parts)
