"""Where a replay carries points of the body that are no particles."""

import numpy as np
from scipy.spatial import cKDTree

from surgisim.artifacts.body import Body
from surgisim.artifacts.replay import Replay
from surgisim.mpm.grid import Grid


def carried(replay: Replay, body: Body, points: np.ndarray) -> np.ndarray:
    """Positions over time [m], (Q, T, 3), of rest points, camera frame [m], (Q, 3).

    The grid's displacement is interpolated at each point. A point further than 1.5 grid spacings
    from every particle is not part of the body: NaN.
    """
    path = np.full((len(points), len(replay.time), 3), np.nan)
    known = np.isfinite(points).all(-1)
    known[known] = cKDTree(body.rest).query(points[known])[0] <= 1.5 * replay.spacing
    grid = Grid(np.asarray(replay.origin, float), np.asarray(replay.shape), float(replay.spacing))
    local = (points - grid.origin) / grid.spacing
    known &= ((local >= 0.5) & (local < grid.shape - 1.5)).all(-1)
    if known.any():
        every_frame = replay.nodes.transpose(1, 0, 2).reshape(grid.count, -1)
        moved = grid.interpolate(every_frame, points[known]).reshape(-1, len(replay.time), 3)
        path[known] = points[known, None] + moved
    return path
