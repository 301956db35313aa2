"""Neighbouring pixels of like colour agree on what they are."""

import numpy as np
from numba import njit

STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))
STRENGTH, ROUNDS = 0.3, 8


def settled(frame: np.ndarray, evidence: np.ndarray) -> np.ndarray:
    """Evidence after each pixel has listened to its eight neighbours, less across edges of the frame, (H, W).

    Mean field of a contrast-sensitive Potts model: Boykov and Jolly, Interactive graph cuts, ICCV 2001, for
    the model; a graph cut would be exact, but knows no degrees.
    """
    links = _links(frame)
    current = evidence
    for _ in range(ROUNDS):
        current = evidence + STRENGTH * _heard(np.tanh(current / 2), links)
    return current


@njit(cache=True, nogil=True)
def _heard(belief, links):
    """What each pixel hears from its neighbours, (H, W)."""
    height, width = belief.shape
    out = np.zeros_like(belief)
    for k in range(len(STEPS)):
        down, right = STEPS[k]
        for i in range(height - down):
            for j in range(max(0, -right), width - max(0, right)):
                out[i, j] += links[k, i, j] * belief[i + down, j + right]
                out[i + down, j + right] += links[k, i, j] * belief[i, j]
    return out


@njit(cache=True, nogil=True)
def _links(frame):
    """How much each pixel listens to its neighbour to the right, below, and on both diagonals below, (4, H, W); nothing
    beyond the picture."""
    height, width, channels = frame.shape
    contrast = np.full((len(STEPS), height, width), np.inf, np.float32)
    for k in range(len(STEPS)):
        down, right = STEPS[k]
        for i in range(height - down):
            for j in range(max(0, -right), width - max(0, right)):
                squares = np.float32(0.0)
                for c in range(channels):
                    apart = np.float32(frame[i, j, c]) - np.float32(frame[i + down, j + right, c])
                    squares += apart * apart
                contrast[k, i, j] = squares
    typical = np.float32(2 * contrast[0, :, : width - 1].mean() + 1e-6)
    for k in range(len(STEPS)):
        away = np.float32(np.sqrt(STEPS[k][0] ** 2 + STEPS[k][1] ** 2))
        contrast[k] = np.exp(-contrast[k] / typical) / away
    return contrast
