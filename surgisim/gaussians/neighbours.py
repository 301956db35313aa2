"""Which points lie next to each other."""

import numpy as np
from scipy.spatial import cKDTree

from surgisim.problem import Problem


def nearest(points: np.ndarray, k: int) -> np.ndarray:
    """The k nearest other points of each, (G, 3) -> (G, k) int64; nearest first, equally near ones by number.

    Raises Problem when there are not k others.
    """
    g = len(points)
    if not 0 < k < g:
        raise Problem(f"nearest: {k} neighbours are wanted for each of {g} points; ask for 1 to {g - 1}.")
    distance, index = cKDTree(points).query(points, k + 1)
    # Among points at one place each may come after others, or not at all: it is put last, and the last is dropped.
    order = np.lexsort((index, distance, index == np.arange(g)[:, None]))
    return np.take_along_axis(index, order, 1)[:, :k]


def groups(points: np.ndarray, k: int) -> np.ndarray:
    """Each point followed by its k nearest others: the set N_i of the paper, (G, k + 1)."""
    return np.column_stack([np.arange(len(points)), nearest(points, k)])
