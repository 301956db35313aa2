"""Displacements along each point's own directions, of some of which a recording is surer than of others."""

import numpy as np


def turned(field: np.ndarray, ways: np.ndarray | None, back: bool = False) -> np.ndarray:
    """Displacements (..., K, T, 3) along each point's directions, rows of (K, 3, 3), or back; as they are if None."""
    if ways is None:
        return field
    return np.einsum("kij,...kti->...ktj" if back else "kij,...ktj->...kti", ways.astype(field.dtype), field)


def told_of(field: np.ndarray, axes: np.ndarray | None, ways: np.ndarray | None) -> np.ndarray:
    """What a recording can tell of displacements (..., K, T, 3): the less, the less sure of an axis it is.

    axes: noise along each of a point's axes, over anything, (K, 3); all of it where None.
    """
    if axes is None:
        return field
    share = axes.min(1, keepdims=True) / axes
    return turned(share[:, None] * turned(field, ways), ways, back=True)
