"""Where, when and in what courses laws are tried."""

import math
from dataclasses import dataclass

import numpy as np

from surgisim.diagnosis.answers import Answers
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.hypothesis import Hypothesis

KNOT = 0.18
"""Time between the knots of a free time course [s]."""
MOMENT = 0.07
"""Time between moments at which something is tried to set in [s]; chosen: in that time a load has half come."""
APART = 0.0075
"""Distance between places that are tried [m], for a body of 36 mm; it follows the body's size."""


@dataclass(frozen=True)
class Block:
    columns: np.ndarray | Answers
    """Displacement of the points by one unit of each [m], (C, K, T, 3)."""
    hypotheses: list[Hypothesis]

    @property
    def written_out(self) -> np.ndarray:
        """The columns [m], (C, K, T, 3)."""
        return self.columns.columns if isinstance(self.columns, Answers) else self.columns


def knots(clip: Clip, apart: float = KNOT) -> np.ndarray:
    """[s], from the first fitted frame to the last, about so far apart, and no closer than frames."""
    last = (clip.until - 1) / clip.fps
    return np.linspace(0, last, max(4, round(last / max(apart, 1 / clip.fps))))


def hats(at: np.ndarray, clip: Clip) -> np.ndarray:
    """Piecewise linear courses over the fitted frames, one a knot, (B, T)."""
    time = clip.time[: clip.until]
    return np.stack([np.interp(time, at, e) for e in np.eye(len(at))])


def places(clip: Clip, apart: float | None = None, depth: float = 0.15) -> np.ndarray:
    """Centres that are tried [m], (Q, 3): a lattice over the observed side, a share of the depth below it."""
    apart = apart or APART * scale(clip)
    axes = plane(clip)
    flat = clip.rest @ axes.T
    low, high = flat.min(0), flat.max(0)
    count = np.maximum(1, np.round((high - low) / apart)).astype(int)
    grid = [a + (np.arange(n) + 0.5) * (b - a) / n for a, b, n in zip(low, high, count, strict=True)]
    wanted = np.stack(np.meshgrid(*grid), -1).reshape(-1, 2)
    away = np.linalg.norm(flat[None] - wanted[:, None], axis=-1)
    wanted = wanted[away.min(1) < 1.2 * apart]
    free = clip.body.rest[~clip.body.held].astype(float)
    across, height = free @ axes.T, free @ clip.normal
    found = []
    for spot in wanted:
        near = np.linalg.norm(across - spot, axis=1) < 0.8 * clip.body.spacing
        if near.any():
            top, bottom = height[near].max(), height[near].min()
            found.append(spot @ axes + (top - depth * (top - bottom)) * clip.normal)
    return np.array(found).reshape(-1, 3)


def scale(clip: Clip) -> float:
    """Size of the body over that for which the lengths here were chosen."""
    return float(np.cbrt(clip.recording.mesh.volume)) / 0.036


def plane(clip: Clip) -> np.ndarray:
    """Two directions along the observed side, (2, 3)."""
    u = np.cross(clip.normal, [0.0, 0.0, 1.0] if abs(clip.normal[2]) < 0.9 else [0.0, 1.0, 0.0])
    u = u / np.linalg.norm(u)
    return np.stack([u, np.cross(clip.normal, u)])


def spread(course: np.ndarray) -> np.ndarray:
    """A course over knots, (B,), for every direction, (3 B, 3)."""
    return np.kron(np.eye(3), course[:, None])


def moments(clip: Clip) -> np.ndarray:
    """At which something is tried to set in [s]."""
    last = (clip.until - 1) / clip.fps
    return np.linspace(0.0, 0.92 * last, max(2, round(0.92 * last / MOMENT)))


def angles(direction: np.ndarray) -> tuple[float, float]:
    """Yaw and pitch [rad] that point along a direction, (3,)."""
    x, y, z = np.asarray(direction, float) / max(np.linalg.norm(direction), 1e-30)
    return math.atan2(x, z), math.asin(min(max(y, -1.0), 1.0))
