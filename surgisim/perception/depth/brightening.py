"""How far tissue comes nearer that no pulled layer explains: by half of what its log brightness grows.

A loop that is lifted and turned over is soon lost to tracking, and goes otherwise than the soft layer of pull.py; but
its light grows with the square of its nearness, and that shows best. How it turns is left out: where a loop hides what
lies behind it no slope leads from one to the other.
"""

import cv2
import numpy as np

LIGHT, ALBEDO = 0.1, 0.25
"""Spread of log brightness along the way of tissue that is followed; of tissue that is not, whose albedo may be another
than what is taken for it."""
FREE = 0.5
"""Expected spread of the change of log depth; .3 was tried beside it on D4D and EndoNeRF pulling."""
NEARBY = 0.04
"""Standard deviation of the neighbourhood that is averaged, as a share of the longer side; chosen on D4D specimen 1
among .02, .04 and .07."""
MOVING = 1.0
"""Motion from which on, and twice which wholly, tissue that is followed may come nearer so [lattice px]."""


def brightened(
    light: np.ndarray, known: np.ndarray, sure: np.ndarray, moved: np.ndarray, unexplained: float
) -> np.ndarray:
    """Change of log depth, (h, w).

    light: log brightness beyond what the tissue's albedo and depth explain. known: how far it is seen, sure: how surely
    the tissue is followed, 0-1. moved: how far it has gone [lattice px]. All (h, w). unexplained: how far a layer does
    not explain the motion that is seen, 0-1.
    """
    lost = 1 - sure
    share = unexplained * np.maximum(lost, np.clip(moved / MOVING - 1, 0, 1))
    # What is covered goes as what is seen around it, which mostly stands still.
    share = known * share + (1 - known) * _around(known * share) / np.maximum(_around(known), 1e-6)
    seen = share * known
    sharp = seen / (LIGHT**2 + (ALBEDO * lost) ** 2)
    # The least squares of light + 2 change, and of change, over a neighbourhood.
    return share * _around(-2 * sharp * light) / np.maximum(_around(4 * sharp + seen / FREE**2), 1e-6)


def _around(field: np.ndarray) -> np.ndarray:
    return cv2.GaussianBlur(field, (0, 0), NEARBY * max(field.shape))
