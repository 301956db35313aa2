"""Measured depth steadied by what light and motion say of the shape.

A second view measures depth everywhere, but how it changes shows in hundredths of a pixel, below its noise; light and
motion (near_light) tell the shape of what moves, but not how far, and nothing of steps. The ratio of both changes
little from place to place but at steps, so it is averaged over neighbours whose ratio is alike, many enough to bear the
noise, and the shape is multiplied by it.

Averaged on a bilateral grid: Chen, Paris and Durand, Real-time edge-aware image processing with the bilateral grid,
SIGGRAPH 2007.
"""

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from surgisim.perception.tracking.spread import spread

REACH, LATER = 0.06, 2.0
"""Standard deviations of a neighbourhood: as a share of the image's width, and in time [frames]; chosen on ten clips of
family 281133 among .03 to .25 and among 0 and 2."""
ALIKE = 0.06
"""Standard deviation of the ratio's logarithm within which neighbours are averaged: several times the noise, less than
a step from one organ to another; chosen on nine of those clips among .04 to .09."""
LONE = 0.05
"""Share of its neighbours that must be alike, or a ratio counts for nothing: a speck is a wrong match. At .3 the tube
that is lifted in EndoNeRF pulling was lost."""
CELL = 0.5
"""Side of the grid's cells over their standard deviation."""


def guided(guide: np.ndarray, z: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Depth [m] and how far each pixel's is measured, 0-1, (T, H, W) each.

    guide: depth to any scale, z: measured [m], known: where (somewhere at least), all (T, H, W).
    """
    apart = np.log(np.where(known, z / guide, 1.0))
    low, high = np.percentile(apart[known], [0.5, 99.5])
    known = known & (apart > low - ALIKE) & (apart < high + ALIKE)
    side = CELL * REACH * z.shape[2]
    level = (np.clip(apart, low - ALIKE, high + ALIKE) - low) / (CELL * ALIKE) + 1 / CELL
    y, x = ((np.arange(n) + 0.5) / side for n in z.shape[1:])
    shape = (int(level.max()) + 2, int(y[-1]) + 2, int(x[-1]) + 2)
    cell = np.rint(y)[:, None] * shape[2] + np.rint(x)
    count, total = np.zeros((2, len(z), *shape), np.float32)
    for t, here in enumerate(known):
        at = (np.rint(level[t][here]) * shape[1] * shape[2] + cell[here]).astype(int)
        for grid, weight in ((count, None), (total, apart[t][here])):
            grid[t] = np.bincount(at, weight, count[t].size).reshape(shape)
    width = (LATER, *[1 / CELL] * 3)
    count, total = (gaussian_filter(grid, width, mode="constant") for grid in (count, total))
    whole, measured = np.empty((2, *z.shape), np.float32)
    for t, here in enumerate(known):
        place = np.stack([level[t], *np.broadcast_arrays(y[:, None], x)])
        alike, summed = (map_coordinates(grid[t], place, order=1) for grid in (count, total))
        around = map_coordinates(count[t].sum(0), place[1:], order=1)
        # All of the neighbours would count as much as the highest point of their spread over levels.
        share = alike * np.sqrt(2 * np.pi) / CELL / np.maximum(around, 1e-6)
        sure = (here & (share > LONE)).astype(np.float32)
        whole[t] = spread(summed / np.maximum(alike, 1e-6), sure)
        measured[t] = sure
    # A frame in which nothing is measured has the ratio of the nearest one in which something is.
    there = np.flatnonzero(measured.any((1, 2)))
    whole = whole[there[np.abs(np.arange(len(z))[:, None] - there).argmin(1)]]
    return guide * np.exp(whole), np.minimum(gaussian_filter(measured, (0, side, side)), 1.0)
