"""A cut: the surface a blade sweeps along two viewing rays, and which links it severs.

The tissue on one side stops seeing nodes across the surface and sees copies of them instead, so
that a cut opens without a particle being removed (the virtual-node idea of Molino, Bao and Fedkiw,
A virtual node algorithm for changing mesh topology during simulation, 2004, on B-spline links).
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Cut:
    """The part of the plane through the camera and two surface points, down to `depth` behind them."""

    begin: np.ndarray
    """Surface point where the cut begins, rest, camera frame [m], (3,)."""
    end: np.ndarray
    """Where it ends [m], (3,)."""
    depth: float
    """How far behind the surface it reaches along the view [m]."""

    def crosses(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Whether the segment from a to b [m], (..., 3) each, passes through the cut, (...)."""
        normal = np.cross(self.begin, self.end)
        normal = normal / np.linalg.norm(normal)
        sa, sb = a @ normal, b @ normal
        between = np.where(sa * sb < 0, sa / np.where(sa == sb, 1.0, sa - sb), 0.0)
        at = a + between[..., None] * (b - a)
        # Where along the cut: at = alpha begin + beta end, both positive inside the wedge.
        basis = np.stack([self.begin, self.end], -1)
        alpha, beta = np.moveaxis(at @ np.linalg.pinv(basis).T, -1, 0)
        span = alpha + beta
        surface = (alpha * self.begin[2] + beta * self.end[2]) / np.where(span == 0, 1.0, span)
        return (sa * sb < 0) & (alpha > 0) & (beta > 0) & (at[..., 2] <= surface + self.depth)
