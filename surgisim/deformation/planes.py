"""Six feature planes at several scales, looked up at the Gaussians' rest positions.

At every scale the three space planes (xy, xz, yz) and the three time planes (xt, yt, zt) are read between their knots,
in straight lines along x, y and z, and in time in straight lines or by cubic B-splines. The time planes' product is
measured from frame 0:

    f = a_xy a_xz a_yz (a_xt a_yt a_zt |_t - a_xt a_yt a_zt |_0)

and the scales' features are laid end to end. So f is zero at t = 0, and a head without biases leaves the canonical
scene alone there: frame 0 is the rest scene by construction. The paper writes a union over scales and does not say how
the planes of one scale are joined; the product is what the works it builds on do
(Cao and Johnson, HexPlane, 2023; Wu et al., 4D Gaussian Splatting, 2024).

All planes live in one flat array; `Layout` says where each begins.
"""

from dataclasses import dataclass

import numpy as np
import torch

from surgisim.deformation import lookup

SPACE = ((0, 1), (0, 2), (1, 2))
"""Axes of the planes xy, xz, yz; shape (Ni, Nj, C)."""


@dataclass(frozen=True)
class Layout:
    """Where each plane begins in the flat array."""

    sizes: np.ndarray
    """Knots along x, y, z, t at every scale, (L, 4) int64."""
    channels: int
    cubic: bool = False
    """Whether a plane is read in time by cubic B-splines, not in straight lines between its knots."""

    @property
    def offsets(self) -> np.ndarray:
        """First number of the planes xy, xz, yz, tx, ty, tz of every scale, (L, 6) int64."""
        return (np.cumsum(self._lengths()) - self._lengths()).reshape(-1, 6)

    @property
    def count(self) -> int:
        """Numbers in all planes."""
        return int(self._lengths().sum())

    @property
    def features(self) -> int:
        """Length of a Gaussian's feature."""
        return len(self.sizes) * self.channels

    def plane(self, flat, scale: int, index: int):
        """View of one plane, (Ni, Nj, C) in space or (Nt, Ni, C) in time."""
        n = [int(v) for v in self.sizes[scale]]
        shape = (n[SPACE[index][0]], n[SPACE[index][1]]) if index < 3 else (n[3], n[index - 3])
        start = int(self.offsets[scale, index])
        return flat[start : start + shape[0] * shape[1] * self.channels].reshape(*shape, self.channels)

    def _lengths(self) -> np.ndarray:
        n = np.asarray(self.sizes, np.int64)
        pairs = [n[:, i] * n[:, j] for i, j in SPACE] + [n[:, 3] * n[:, i] for i in range(3)]
        return (np.stack(pairs, 1) * self.channels).reshape(-1)


def features(flat: torch.Tensor, where: torch.Tensor, time: float, layout: Layout) -> torch.Tensor:
    """Feature of every point at one time.

    flat: all planes end to end, float32 or float64; where: position in the box, 0-1 along each axis, (G, 3), taken at
    the border where outside; time: in the box, 0-1. Returns (G, L C), differentiable in `flat` and `where`.
    """
    return _Features.apply(flat, where, time, layout)


class _Features(torch.autograd.Function):
    @staticmethod
    def forward(ctx, flat, where, time, layout):
        ctx.save_for_backward(flat, where)
        ctx.time, ctx.layout = time, layout
        out = np.empty((len(where), layout.features), where.detach().numpy().dtype)
        lookup.read(
            flat.detach().numpy(),
            where.detach().numpy(),
            time,
            layout.sizes,
            layout.offsets,
            layout.channels,
            layout.cubic,
            out,
        )
        return torch.from_numpy(out)

    @staticmethod
    def backward(ctx, slope):
        flat, where = (a.detach().numpy() for a in ctx.saved_tensors)
        layout = ctx.layout
        blocks = -(-layout.channels // lookup.BLOCK)
        to_flat = np.zeros_like(flat)
        to_where = np.zeros((len(layout.sizes) * blocks, *where.shape), where.dtype)
        lookup.give_back(
            flat,
            where,
            ctx.time,
            layout.sizes,
            layout.offsets,
            layout.channels,
            layout.cubic,
            np.ascontiguousarray(slope.numpy()),
            to_flat,
            to_where,
        )
        return torch.from_numpy(to_flat), torch.from_numpy(to_where.sum(0)), None, None
