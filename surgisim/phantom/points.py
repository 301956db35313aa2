"""Surface points spread over frame 0 and followed with the mesh."""

import numpy as np

from surgisim.phantom import instrument
from surgisim.phantom.block import Block
from surgisim.phantom.view import View, look

NEAR = 1.0e-3
"""How far behind the surface seen at its pixel a point may lie and still count as seen [m]."""


def choose(
    view: View, block: Block, points: np.ndarray, tool: np.ndarray, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """About `count` points on the tissue seen in frame 0: nodes, (K, 3), and their weights, (K, 3)."""
    hits = look(view, points, block.triangles, 1)
    border = 2
    free = (hits.triangle >= 0) & ~tool
    pitch = np.sqrt(free[border:-border, border:-border].sum() / count)
    x = np.arange(border + pitch / 2, view.width - border, pitch)
    y = np.arange(border + pitch / 2, view.height - border, pitch)
    grid = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
    grid = np.rint(grid + rng.uniform(-0.3, 0.3, grid.shape) * pitch).astype(int)
    column, row = np.clip(grid, border, np.array([view.width, view.height]) - 1 - border).T
    keep = free[row, column]
    row, column = row[keep], column[keep]
    return block.triangles[hits.triangle[row, column]], hits.weights[row, column]


def follow(view: View, block: Block, positions: np.ndarray, depth: np.ndarray, cones: list[np.ndarray], marks):
    """Where the points go, camera frame [m], (K, T, 3), and whether they are seen, (K, T) bool."""
    nodes, weights = marks
    xyz = np.einsum("kc,tkci->kti", weights, positions[:, nodes])
    visible = np.zeros(xyz.shape[:2], bool)
    for t in range(len(positions)):
        at = xyz[:, t]
        x, y = np.rint(view.project(at)).astype(int).T
        inside = (x >= 0) & (x < view.width) & (y >= 0) & (y < view.height)
        seen = depth[t][np.clip(y, 0, view.height - 1), np.clip(x, 0, view.width - 1)]
        slope = _steepness(depth[t])[np.clip(y, 0, view.height - 1), np.clip(x, 0, view.width - 1)]
        front = at[:, 2] < seen + NEAR + slope
        bare = instrument.cast(cones[t], at / at[:, 2:])[0] > at[:, 2]
        visible[:, t] = inside & front & bare
    return xyz, visible


def _steepness(depth: np.ndarray) -> np.ndarray:
    """Change of depth over a pixel [m]."""
    down, right = np.gradient(np.where(np.isfinite(depth), depth, 0.0))
    return np.hypot(down, right)
