"""From where a body is looked at: along the axes of the recording's own frame."""

from dataclasses import dataclass

import numpy as np

from surgisim.report.diagnosed.case import Diagnosed
from surgisim.report.views import View

SIZE = (760, 560)
AXES = ("x", "y", "z")
TURN, TILT = 25.0, 40.0
"""Of the oblique look about the vertical and from the horizontal [degrees]."""


@dataclass(frozen=True)
class Side:
    title: str
    view: View
    axes: tuple[str, str, int] | None
    """Axis that runs to the right in the picture, axis along its height, and 1 where that one grows upwards or -1; None
    where the look is along no axis."""


def sides(case: Diagnosed, more: tuple[np.ndarray, ...] = ()) -> dict[str, Side]:
    """The body from above, obliquely and from the side, long side to the right; `more`: points (3,) [m] to show too."""
    vertical = int(np.argmax(np.abs(case.up)))
    up = np.zeros(3)
    up[vertical] = np.sign(case.up[vertical])
    flat = [k for k in range(3) if k != vertical]
    long = max(flat, key=lambda k: np.ptp(case.mismatch.particles[:, k]))
    right, turn, tilt = np.eye(3)[long], np.radians(TURN), np.radians(TILT)
    away = np.cross(up, right)
    turned = np.cos(turn) * right - np.sin(turn) * away
    ways = {
        "above": ("from above", right, -up),
        "oblique": ("from half above", turned, np.cos(tilt) * np.cross(up, turned) - np.sin(tilt) * up),
        "side": ("from the side", right, away),
    }
    points = np.concatenate([case.mismatch.particles, case.mismatch.points, *(m[None] for m in more)])
    return {name: _side(words, points, *way) for name, (words, *way) in ways.items()}


def _side(words: str, points: np.ndarray, right: np.ndarray, forward: np.ndarray) -> Side:
    view = _view(points, right, forward)
    across, along, height = (int(np.argmax(np.abs(way))) for way in (right, forward, view.down))
    if abs(right[across]) < 0.999:
        return Side(words, view, None)
    sign = "+" if forward[along] > 0 else "\N{MINUS SIGN}"
    upward = (AXES[across], AXES[height], -int(np.sign(view.down[height])))
    return Side(f"{words}, along {sign}{AXES[along]}", view, upward)


def _view(points: np.ndarray, right: np.ndarray, forward: np.ndarray) -> View:
    down = np.cross(forward, right)
    flat = np.stack([points @ right, points @ down], -1)
    low, high = flat.min(0), flat.max(0)
    pixel = 1.12 * float(((high - low) / SIZE).max())
    middle, half = (low + high) / 2, pixel * np.array(SIZE) / 2
    # Only as high as the body is, with room for a scale: a thin one leaves no empty paper.
    half[1] = min(half[1], 0.6 * float(high[1] - low[1]) + 0.07 * float(high[0] - low[0]))
    return View(right, down, middle - half, middle + half, SIZE[0], round(SIZE[0] * half[1] / half[0]))
