"""The nodes that carry a body, and how points hang on them."""

import numpy as np
from scipy import sparse

from surgisim.mpm.extension import extension
from surgisim.mpm.grid import Grid
from surgisim.mpm.kink import Ball, Kinks
from surgisim.mpm.links import links_through
from surgisim.mpm.tear import Severing


class Nodes:
    """Solid nodes `place` (A,) of a grid, and the rule that every other node near the body follows.

    The last `kinks.count` of them belong to the functions of gripped balls and stand at no place of the grid (-1).
    """

    def __init__(
        self, grid: Grid, rest: np.ndarray, volume: np.ndarray, cut: Severing | None, balls: tuple[Ball, ...] = ()
    ) -> None:
        """Particles `rest` [m], (P, 3), of `volume` [m^3], (P,)."""
        self.grid, self.cut = grid, cut
        nodes, weight, _ = self.stencil(rest)
        sides = 1 if cut is None else 2
        share = np.bincount(nodes.ravel(), (weight * volume[:, None]).ravel(), sides * grid.count)
        self.place, self.rule = extension(grid, share, cut)
        index, link = self._spline_links(rest)
        self.kinks = Kinks(balls, grid.spacing, len(self.place), index, link, rest, volume)
        self.place = np.concatenate([self.place, np.full(self.kinks.count, -1, self.place.dtype)])
        self.rest_links = self.kinks.added(rest, index, link)
        """Of particles at rest, as `links` gives them."""

    def stencil(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As Grid.stencil; a link across the cut leads to the node's copy on the point's own side, N further on."""
        nodes, weight, gradient = self.grid.stencil(points)
        if self.cut is not None:
            across = self.cut.crosses(points[:, None], self.grid.positions()[nodes])
            nodes = nodes + across.astype(np.int32) * self.grid.count
        return nodes, weight, gradient

    def links(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Solid nodes (Q, L) that carry points [m], (Q, 3), with weight and its gradient [1, 1/m], (Q, L, 4).

        Rows shorter than the longest are padded with links of weight zero to their first node.
        """
        return self.kinks.added(points, *self._spline_links(points))

    def _spline_links(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return links_through(*self.stencil(points), self.rule)

    def carry(self, points: np.ndarray) -> sparse.csr_matrix:
        """Interpolation from solid nodes to points [m], (Q, 3), (Q, A); see `support` for how far a point has one."""
        return self._interpolation(*self.links(points))

    def carry_rest(self) -> sparse.csr_matrix:
        """The same to the particles at rest, (P, A)."""
        return self._interpolation(*self.rest_links)

    def _interpolation(self, index: np.ndarray, link: np.ndarray) -> sparse.csr_matrix:
        rows = np.repeat(np.arange(len(index)), index.shape[1])
        return sparse.csr_matrix((link[..., 0].ravel(), (rows, index.ravel())), (len(index), len(self.place)))

    def support(self, carry: sparse.csr_matrix) -> np.ndarray:
        """Sum of the splines' weights in each row of `carry`, (Q,): 1 on the body, less where a point is off it.

        What kinks add there is left out: it bends the displacement and sums to no whole.
        """
        return np.asarray(carry[:, : self.rule.shape[1]].sum(1)).ravel()

    def displaced(self, u: np.ndarray) -> np.ndarray:
        """Nodal displacement [m], (..., N, 3) or (..., 2 N, 3) once cut, of every node that follows the body.

        The kinks at gripped balls are no nodes of the grid and are left out; `carry` has them.
        """
        plain = self.rule.shape[1]
        flat = np.moveaxis(u[..., :plain, :].astype(float), -2, 0).reshape(plain, -1)
        return np.moveaxis((self.rule @ flat).reshape(-1, *u.shape[:-2], 3), 0, -2)

    def inherited(self, other: "Nodes", u: np.ndarray) -> np.ndarray:
        """Nodal values of `other`, (A', 3), over these nodes, (A, 3): a copy starts as it was, or as its node.

        Kinks keep their values where both have the same balls, and begin at zero elsewhere.
        """
        plain = self.rule.shape[1]
        new = np.zeros((len(self.place), 3), u.dtype)
        place = self.place[:plain]
        there = np.diff(other.rule.indptr) > 0
        kept = np.array([p < len(there) and there[p] for p in place], bool)
        new[:plain] = other.displaced(u)[np.where(kept, place, place % self.grid.count)]
        if len(other.kinks.balls) == len(self.kinks.balls):
            new[plain:] = u[other.rule.shape[1] :]
        return new
