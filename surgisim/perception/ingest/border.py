"""Where the picture is inside its black surround (an endoscope's circle, a letterbox)."""

import numpy as np

BLACK = 24
"""Brightest channel that still counts as surround [0-255]."""


def lit_box(top: np.ndarray) -> tuple[int, int, int, int]:
    """Left, top, width, height of what is ever lit [px]; everything when that is unclear.

    Conservative: a row or column stays when a fiftieth of it is lit, and a box below a quarter of the
    picture is taken for a dark scene, not for a border.
    """
    height, width = top.shape
    lit = top > BLACK
    rows = np.flatnonzero(lit.mean(1) > 0.02)
    columns = np.flatnonzero(lit.mean(0) > 0.02)
    if not len(rows) or not len(columns):
        return 0, 0, width, height
    left, right = int(columns[0]), int(columns[-1]) + 1
    upper, lower = int(rows[0]), int(rows[-1]) + 1
    if (right - left) * (lower - upper) < 0.25 * width * height:
        return 0, 0, width, height
    return left, upper, right - left, lower - upper


def is_black(top: np.ndarray) -> bool:
    """Whether no frame shows anything."""
    return bool((top > BLACK).mean() < 1e-3)
