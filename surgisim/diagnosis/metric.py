"""Least squares with noise that is white but for a few directions: nuisances, and what the simulator gets wrong.

With whitened columns U scaled to their prior standard deviations, the covariance is 1 + U U^T, and (Woodbury)

    <a, b> = a^T (1 + U U^T)^-1 b = a^T b - (U^T a)^T (1 + U^T U)^-1 (U^T b).
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

ROWS = 4096
"""Rows that are taken to double precision at once."""


@dataclass(frozen=True)
class Metric:
    columns: np.ndarray
    """U, (N, M) float32."""
    factor: tuple

    @property
    def log_det(self) -> float:
        """log determinant of the covariance."""
        return float(2 * np.log(np.diag(self.factor[0])).sum())

    def seen_through(self, vectors: np.ndarray) -> np.ndarray:
        """U^T of vectors (N,) or (N, C)."""
        return (self.columns.T @ vectors.astype(np.float32)).astype(float)

    def gram(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """<a, b> of columns (N, C) and (N, D)."""
        plain = (a.T.astype(np.float32) @ b.astype(np.float32)).astype(float)
        mine = self.seen_through(a)
        return plain - mine.T @ cho_solve(self.factor, mine if b is a else self.seen_through(b))

    def cleared(self, vectors: np.ndarray) -> np.ndarray:
        """(1 + U U^T)^-1 of vectors (N, C), float32: their plain products with others are those of `gram`."""
        return vectors.astype(np.float32) - self.explained(vectors)

    def likely(self, vectors: np.ndarray) -> np.ndarray:
        """Most likely values of the directions for vectors (N,) or (N, C), in prior standard deviations, (M, ...)."""
        return cho_solve(self.factor, self.seen_through(vectors))

    def explained(self, vector: np.ndarray) -> np.ndarray:
        """The part of vectors (N,) or (N, C) that the directions take: nuisances at their most likely values."""
        return self.columns @ self.likely(vector).astype(np.float32)

    def draw(self, rng: np.random.Generator, count: int, project) -> np.ndarray:
        """Residuals of nothing but noise and nuisance, (N, count); `project` takes out each point's constant."""
        white = project(rng.standard_normal((len(self.columns), count)).astype(np.float32))
        return white + self.columns @ rng.standard_normal((self.columns.shape[1], count)).astype(np.float32)


def metric(columns: np.ndarray) -> Metric:
    """columns: whitened and scaled to one prior standard deviation, (N, M)."""
    U = np.ascontiguousarray(columns if columns.shape[1] else np.zeros((len(columns), 1)), np.float32)
    one = np.eye(U.shape[1])
    try:
        factor = cho_factor(one + (U.T @ U).astype(float))
    except LinAlgError:
        # Columns so large and so alike that their products, rounded to single precision, are those of no columns.
        factor = cho_factor(one + products(U, U))
    return Metric(U, factor)


def products(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Of columns (N, C) and (N, D), float32, with each other in double precision, (C, D)."""
    rows = len(a) // ROWS + 1
    parts = zip(np.array_split(a, rows), np.array_split(b, rows), strict=True)
    return sum(one.T.astype(float) @ other.astype(float) for one, other in parts)
