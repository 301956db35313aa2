"""Where a replay carries points of the body that are no particles."""

import numpy as np
from scipy.spatial import cKDTree

from surgisim.artifacts.body import Body
from surgisim.artifacts.replay import Replay
from surgisim.mpm.grid import Grid

NEIGHBOURS = 4
"""Particles that say what the grid leaves out."""


def carried(replay: Replay, body: Body, points: np.ndarray) -> np.ndarray:
    """Positions over time [m], (Q, T, 3), of rest points, camera frame [m], (Q, 3).

    The grid's displacement is interpolated at each point; what particles near it move beside that, as at a grip's skin
    where splines cannot bend (mpm/kink.py), is added, weighted by their distance. A point further than 1.5 grid
    spacings from every particle is not part of the body: NaN.
    """
    path = np.full((len(points), len(replay.time), 3), np.nan)
    known = np.isfinite(points).all(-1)
    tree = cKDTree(body.rest)
    known[known] = tree.query(points[known])[0] <= 1.5 * replay.spacing
    grid = Grid(np.asarray(replay.origin, float), np.asarray(replay.shape), float(replay.spacing))
    local = (points - grid.origin) / grid.spacing
    known &= ((local >= 0.5) & (local < grid.shape - 1.5)).all(-1)
    if known.any():
        every_frame = replay.nodes.transpose(1, 0, 2).reshape(grid.count, -1)

        def interpolated(at: np.ndarray) -> np.ndarray:
            return grid.interpolate(every_frame, at).reshape(-1, len(replay.time), 3)

        away, near = tree.query(points[known], min(NEIGHBOURS, len(body.rest)))
        away, near = away.reshape(len(away), -1), near.reshape(len(near), -1)
        weight = 1 / (away + 1e-3 * replay.spacing)
        who, at = np.unique(near, return_inverse=True)
        rest = body.rest[who].astype(float)
        beside = replay.position[:, who].swapaxes(0, 1) - rest[:, None] - interpolated(rest)
        bent = np.einsum("qk,qktc->qtc", weight / weight.sum(1, keepdims=True), beside[at.reshape(near.shape)])
        path[known] = points[known, None] + interpolated(points[known]) + bent
    return path
