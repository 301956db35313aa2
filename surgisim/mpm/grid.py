"""The background grid and its quadratic B-splines.

Steffen, Kirby and Berzins, Analysis and reduction of quadrature errors in the material point
method, 2008, section 3.2.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from surgisim.problem import Problem


@dataclass(frozen=True)
class Grid:
    """Node (i, j, k) sits at origin + spacing (i, j, k); N = product of `shape`, k runs fastest."""

    origin: np.ndarray
    """[m], (3,)."""
    shape: np.ndarray
    """Nodes along each axis, (3,) int."""
    spacing: float
    """[m]"""

    @classmethod
    def around(cls, points: np.ndarray, spacing: float, carried: np.ndarray | None = None) -> "Grid":
        """The smallest grid on which every point [m], (Q, 3) has all of its 27 nodes.

        It is laid around `points`, and grown by whole cells for further points `carried` (Q', 3), so that those do
        not shift where the cells fall.
        """
        low, high = points.min(0).astype(float), points.max(0).astype(float)
        origin = low - 1.5 * spacing
        if carried is not None and len(carried):
            outer = carried.min(0).astype(float) - 1.5 * spacing
            origin = origin - spacing * np.maximum(0, np.ceil((origin - outer) / spacing))
            high = np.maximum(high, carried.max(0))
        shape = np.ceil((high - origin) / spacing).astype(int) + 3
        return cls(origin, shape, float(spacing))

    @property
    def count(self) -> int:
        return int(np.prod(self.shape))

    def stencil(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Nodes (Q, 27), weights (Q, 27) and their gradients [1/m], (Q, 27, 3) of points [m], (Q, 3)."""
        local = (np.asarray(points, float) - self.origin) / self.spacing
        base = np.floor(local - 0.5).astype(int)
        outside = ((base < 0) | (base + 3 > self.shape)).any(-1)
        if outside.any():
            where = np.round(np.asarray(points)[outside][0], 4).tolist()
            raise Problem(
                f"grid: point {where} m lies outside the grid ({int(outside.sum())} do). "
                "Build the grid around every point that it has to carry."
            )
        f = local - base
        value = np.stack([0.5 * (1.5 - f) ** 2, 0.75 - (f - 1) ** 2, 0.5 * (f - 0.5) ** 2], -1)
        slope = np.stack([f - 1.5, -2 * (f - 1), f - 0.5], -1) / self.spacing
        i, j, k = (a.ravel() for a in np.meshgrid(*[np.arange(3)] * 3, indexing="ij"))
        wx, wy, wz = value[:, 0, i], value[:, 1, j], value[:, 2, k]
        weight = wx * wy * wz
        gradient = np.stack([slope[:, 0, i] * wy * wz, wx * slope[:, 1, j] * wz, wx * wy * slope[:, 2, k]], -1)
        steps = np.array([self.shape[1] * self.shape[2], self.shape[2], 1])
        nodes = (base @ steps)[:, None] + (np.stack([i, j, k], -1) @ steps)[None]
        return nodes.astype(np.int32), weight, gradient

    def matrix(self, points: np.ndarray) -> sparse.csr_matrix:
        """Interpolation from nodes to points [m], (Q, 3), as (Q, N)."""
        nodes, weight, _ = self.stencil(points)
        rows = np.repeat(np.arange(len(nodes)), 27)
        return sparse.csr_matrix((weight.ravel(), (rows, nodes.ravel())), (len(nodes), self.count))

    def interpolate(self, nodes: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Values at points [m], (Q, 3) of a field (N, C) on the nodes, (Q, C)."""
        return self.matrix(points) @ nodes

    def deformation_gradient(self, displacement: np.ndarray, points: np.ndarray) -> np.ndarray:
        """F at rest points [m], (Q, 3), of a nodal displacement [m], (N, 3), as (Q, 3, 3)."""
        index, _, gradient = self.stencil(points)
        return np.eye(3) + np.einsum("qka,qkb->qab", displacement[index], gradient)

    def positions(self) -> np.ndarray:
        """Where the nodes are [m], (N, 3)."""
        axes = [self.origin[a] + self.spacing * np.arange(self.shape[a]) for a in range(3)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def same_nodes(local: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points that hang on the same nodes: those nodes, (C, K), in their order, and each point's row there, (P,)."""
    # Big-endian bytes compare as the numbers do: neighbours stay neighbours.
    rows = np.ascontiguousarray(local, ">i4").view(np.dtype((np.void, 4 * local.shape[1]))).ravel()
    _, first, cell = np.unique(rows, return_index=True, return_inverse=True)
    return local[first], cell


def cells_of(local: np.ndarray, links: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Points (P, K), (P, K, 4) by the nodes they hang on: those nodes, (C, K), and their row there, (P,).

    Of a row's nodes those come first that weigh something for any of its points; how many those are, (C,), and the
    links in that order, come last.
    """
    nodes, cell = same_nodes(local)
    used = np.zeros(nodes.shape, bool)
    np.logical_or.at(used, cell, links.any(-1))
    order = np.argsort(~used, axis=1, kind="stable")
    moved = np.take_along_axis(links, order[cell][..., None], 1)
    return np.take_along_axis(nodes, order, 1), cell, used.sum(1), moved
