"""Functions that bend where a spline cannot: at the skin of a gripped ball.

Tissue inside a grip moves as one and the tissue around it falls away at once: the displacement has a kink at the
ball's skin, which a quadratic spline smooths over a cell and more. Each ball adds a few functions of its own,

    phi = p(n) min(0, exp((R - d) / R) - 1),   p in {1, n_x, n_y, n_z}

d the distance to the centre at rest and n the direction from it, less their best fit by the splines, so that only the
kink is left and it reaches about two cells. A function is one more node with three components: it moves by the forces
along it and holds on to nothing else.
Moes, Dolbow and Belytschko, A finite element method for crack growth without remeshing, 1999 (enrichment); Babuska and
Melenk, The partition of unity method, 1997.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from surgisim.mpm.grid import same_nodes

FUNCTIONS = 4
"""Of each ball."""
REACH = 3.0
"""Cells beyond the skin after which nothing is left of them."""
SUPPORT = 5.0
"""Cells beyond the skin that the fit by the splines looks at."""


@dataclass(frozen=True)
class Ball:
    center: np.ndarray
    """At rest [m], (3,)."""
    radius: float
    """[m]"""
    skin: float = 0.0
    """Width of the shell about the radius in which the bend is spread out, 0 for a sharp one [m]."""


class Kinks:
    """The functions of `balls`, over spline nodes 0 to `first` - 1; their own nodes follow those."""

    def __init__(
        self, balls: tuple[Ball, ...], spacing: float, first: int, index: np.ndarray, link: np.ndarray,
        rest: np.ndarray, volume: np.ndarray,
    ) -> None:  # fmt: skip
        """index, link: spline nodes and weights of particles `rest` [m], (P, 3), of `volume` [m^3], (P,)."""
        self.balls, self.spacing, self.first = balls, spacing, first
        self.fits = [self._fit(ball, index, link, rest, volume) for ball in balls]

    @property
    def count(self) -> int:
        return FUNCTIONS * len(self.balls)

    def added(self, points: np.ndarray, index: np.ndarray, link: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Spline links (Q, L), (Q, L, 4) of points [m], (Q, 3), with those to the kinks near them."""
        used, cell = np.zeros(len(points), int), same_nodes(index)[1]
        blocks: list[tuple[np.ndarray, np.ndarray]] = []
        for b, (ball, fit) in enumerate(zip(self.balls, self.fits, strict=True)):
            inside = self._away(ball, points) < REACH
            # What hangs on the same splines hangs on the same kinks: a cell's points stay together.
            near = np.flatnonzero(np.bincount(cell, inside)[cell])
            value, slope = (a * inside[near].reshape(-1, *[1] * (a.ndim - 1)) for a in _kinked(ball, points[near]))
            mine = fit[index[near]] * inside[near, None, None]
            value = value - np.einsum("qk,qkm->qm", link[near, :, 0], mine)
            slope = slope - np.einsum("qkd,qkm->qmd", link[near, :, 1:], mine)
            while len(blocks) <= (used[near].max() if len(near) else -1):
                blocks.append((np.repeat(index[:, :1], FUNCTIONS, 1), np.zeros((len(points), FUNCTIONS, 4))))
            for slot, (nodes, links) in enumerate(blocks):
                here = used[near] == slot
                nodes[near[here]] = self.first + FUNCTIONS * b + np.arange(FUNCTIONS)
                links[near[here]] = np.concatenate([value[here, :, None], slope[here]], -1)
            used[near] += 1
        return (
            np.concatenate([index, *(nodes for nodes, _ in blocks)], 1).astype(np.int32),
            np.concatenate([link, *(links for _, links in blocks)], 1),
        )

    def _fit(self, ball, index, link, rest, volume) -> np.ndarray:
        """Nodal values of the splines nearest to the ball's functions, (first, FUNCTIONS)."""
        near = np.flatnonzero(self._away(ball, rest) < SUPPORT)
        rows = np.repeat(np.arange(len(near)), index.shape[1])
        weights = sparse.csr_matrix((link[near, :, 0].ravel(), (rows, index[near].ravel())), (len(near), self.first))
        nodes = np.flatnonzero(np.asarray(abs(weights).sum(0)).ravel())
        weights = weights[:, nodes]
        share = sparse.diags(volume[near] / volume[near].mean()) if len(near) else sparse.identity(0)
        normal = weights.T @ share @ weights
        ridge = 1e-8 * normal.diagonal().max(initial=1.0) * sparse.identity(len(nodes))
        fit = np.zeros((self.first, FUNCTIONS))
        if len(nodes):
            fit[nodes] = splu((normal + ridge).tocsc()).solve(weights.T @ (share @ _kinked(ball, rest[near])[0]))
        return fit

    def _away(self, ball: Ball, points: np.ndarray) -> np.ndarray:
        """Distance beyond the ball's skin, in cells, (Q,)."""
        return (np.linalg.norm(points - ball.center, axis=1) - ball.radius) / self.spacing


def _kinked(ball: Ball, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The functions (Q, FUNCTIONS) and their gradients [1/m], (Q, FUNCTIONS, 3) at points [m], (Q, 3)."""
    arm = points - ball.center
    d = np.maximum(np.linalg.norm(arm, axis=1), 1e-6 * ball.radius)
    n = arm / d[:, None]
    skin = max(ball.skin, 1e-6 * ball.radius)
    # How much of the shell lies outside the ball, and how far beyond the skin what is there is on average.
    outside = np.clip((d - ball.radius) / skin + 0.5, 0.0, 1.0)
    beyond = np.where(outside < 1.0, 0.5 * skin * outside**2, d - ball.radius)
    fall = np.exp(-beyond / ball.radius)
    psi, steep = fall - 1, -fall / ball.radius * outside
    p = np.concatenate([np.ones((len(d), 1)), n], 1)
    turn = np.zeros((len(d), FUNCTIONS, 3))
    turn[:, 1:] = (np.eye(3) - n[:, :, None] * n[:, None, :]) / d[:, None, None]
    return psi[:, None] * p, (steep[:, None] * p)[..., None] * n[:, None] + psi[:, None, None] * turn
