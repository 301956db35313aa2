"""Where tracked neighbours say that a pixel went."""

import numpy as np
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import QhullError


def flow_at(pixels: np.ndarray, xy: np.ndarray, visible: np.ndarray) -> np.ndarray:
    """Positions over time [px], (Q, T, 2), of frame-0 `pixels` (Q, 2), from tracks xy (K, T, 2), visible (K, T).

    In each frame the displacement of the visible tracks is interpolated linearly between their
    places in frame 0 (Delaunay triangles). A pixel outside of all triangles, or whose triangle's
    longest side exceeds ten times the tracks' median spacing, has no answer there: NaN.
    """
    start = xy[:, 0].astype(np.float64)
    reach = 10 * spacing(start)
    moved = np.full((len(pixels), xy.shape[1], 2), np.nan)
    for t in range(xy.shape[1]):
        seen = visible[:, t] & np.isfinite(xy[:, t]).all(-1)
        if seen.sum() < 3:
            continue
        try:
            carry = LinearNDInterpolator(start[seen], (xy[seen, t] - start[seen]).astype(np.float64))
        except QhullError:  # all on one line: no triangle, no answer
            continue
        triangle = carry.tri.find_simplex(pixels)
        corners = start[seen][carry.tri.simplices[triangle]]
        longest = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=-1).max(1)
        good = (triangle >= 0) & (longest <= reach)
        moved[good, t] = pixels[good] + carry(pixels[good])
    return moved


def spacing(points: np.ndarray) -> float:
    """Median distance to the nearest neighbour, (K, D); infinite for a single point."""
    from scipy.spatial import cKDTree

    if len(points) < 2:
        return float("inf")
    return float(np.median(cKDTree(points).query(points, 2)[0][:, 1]))
