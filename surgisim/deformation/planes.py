"""Six feature planes at several scales, looked up at the Gaussians' rest positions.

At every scale the three space planes (xy, xz, yz) and the three time planes (xt, yt, zt) are read by bilinear
interpolation; the time planes' product is measured from frame 0:

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
from numba import njit, prange

SPACE = ((0, 1), (0, 2), (1, 2))
"""Axes of the planes xy, xz, yz; shape (Ni, Nj, C)."""
BLOCK = 8
"""Channels one task of the backward pass owns: no two tasks write to the same number."""


@dataclass(frozen=True)
class Layout:
    """Where each plane begins in the flat array."""

    sizes: np.ndarray
    """Knots along x, y, z, t at every scale, (L, 4) int64."""
    channels: int

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
        _forward(
            flat.detach().numpy(), where.detach().numpy(), time, layout.sizes, layout.offsets, layout.channels, out
        )
        return torch.from_numpy(out)

    @staticmethod
    def backward(ctx, slope):
        flat, where = (a.detach().numpy() for a in ctx.saved_tensors)
        layout = ctx.layout
        blocks = -(-layout.channels // BLOCK)
        to_flat = np.zeros_like(flat)
        to_where = np.zeros((len(layout.sizes) * blocks, *where.shape), where.dtype)
        _backward(
            flat,
            where,
            ctx.time,
            layout.sizes,
            layout.offsets,
            layout.channels,
            np.ascontiguousarray(slope.numpy()),
            to_flat,
            to_where,
        )
        return torch.from_numpy(to_flat), torch.from_numpy(to_where.sum(0)), None, None


@njit(cache=True)
def _knot(u, n):
    """Lower knot, weight of the upper one, and slope of that weight in u (0 outside the box)."""
    if u <= 0.0:
        return 0, 0.0 * u, 0.0 * u
    if u >= 1.0:
        return n - 2, 0.0 * u + 1.0, 0.0 * u
    s = u * (n - 1)
    k = min(int(s), n - 2)
    return k, s - k, 0.0 * u + (n - 1)


@njit(cache=True)
def _rows(flat, time, sizes, offsets, channels, scale):
    """The three time planes at `time` and at 0, (2, 3, longest, C)."""
    longest = max(sizes[scale, 0], sizes[scale, 1], sizes[scale, 2])
    rows = np.empty((2, 3, longest, channels), flat.dtype)
    k, w, _ = _knot(time, sizes[scale, 3])
    for p in range(3):
        n, start = sizes[scale, p], offsets[scale, 3 + p]
        for i in range(n):
            for c in range(channels):
                low = flat[start + (k * n + i) * channels + c]
                high = flat[start + ((k + 1) * n + i) * channels + c]
                rows[0, p, i, c] = low + (high - low) * w
                rows[1, p, i, c] = flat[start + i * channels + c]
    return rows


@njit(cache=True, parallel=True)
def _forward(flat, where, time, sizes, offsets, channels, out):
    for scale in range(len(sizes)):
        rows = _rows(flat, time, sizes, offsets, channels, scale)
        n1, n2 = sizes[scale, 1], sizes[scale, 2]
        a, b, d = offsets[scale, 0], offsets[scale, 1], offsets[scale, 2]
        for g in prange(len(where)):
            i, wi, _ = _knot(where[g, 0], sizes[scale, 0])
            j, wj, _ = _knot(where[g, 1], n1)
            k, wk, _ = _knot(where[g, 2], n2)
            for c in range(channels):
                p = a + (i * n1 + j) * channels + c
                low = flat[p] + (flat[p + channels] - flat[p]) * wj
                p += n1 * channels
                xy = low + (flat[p] + (flat[p + channels] - flat[p]) * wj - low) * wi
                p = b + (i * n2 + k) * channels + c
                low = flat[p] + (flat[p + channels] - flat[p]) * wk
                p += n2 * channels
                xz = low + (flat[p] + (flat[p + channels] - flat[p]) * wk - low) * wi
                p = d + (j * n2 + k) * channels + c
                low = flat[p] + (flat[p + channels] - flat[p]) * wk
                p += n2 * channels
                yz = low + (flat[p] + (flat[p + channels] - flat[p]) * wk - low) * wj
                now = (
                    (rows[0, 0, i, c] + (rows[0, 0, i + 1, c] - rows[0, 0, i, c]) * wi)
                    * (rows[0, 1, j, c] + (rows[0, 1, j + 1, c] - rows[0, 1, j, c]) * wj)
                    * (rows[0, 2, k, c] + (rows[0, 2, k + 1, c] - rows[0, 2, k, c]) * wk)
                )
                rest = (
                    (rows[1, 0, i, c] + (rows[1, 0, i + 1, c] - rows[1, 0, i, c]) * wi)
                    * (rows[1, 1, j, c] + (rows[1, 1, j + 1, c] - rows[1, 1, j, c]) * wj)
                    * (rows[1, 2, k, c] + (rows[1, 2, k + 1, c] - rows[1, 2, k, c]) * wk)
                )
                out[g, scale * channels + c] = xy * xz * yz * (now - rest)


@njit(cache=True, parallel=True)
def _backward(flat, where, time, sizes, offsets, channels, slope, to_flat, to_where):
    blocks = (channels + BLOCK - 1) // BLOCK
    for task in prange(len(sizes) * blocks):
        scale, first = task // blocks, (task % blocks) * BLOCK
        _backward_block(
            flat,
            where,
            time,
            sizes,
            offsets,
            channels,
            slope,
            scale,
            first,
            min(first + BLOCK, channels),
            to_flat,
            to_where[task],
        )


@njit(cache=True)
def _spread(to_flat, p, across, down, w_across, w_down, value):
    """Give a bilinear lookup's slope to its four knots."""
    to_flat[p] += value * (1 - w_down) * (1 - w_across)
    to_flat[p + across] += value * (1 - w_down) * w_across
    to_flat[p + down] += value * w_down * (1 - w_across)
    to_flat[p + down + across] += value * w_down * w_across


@njit(cache=True)
def _backward_block(flat, where, time, sizes, offsets, channels, slope, scale, first, last, to_flat, to_where):
    rows = _rows(flat, time, sizes, offsets, channels, scale)
    to_rows = np.zeros_like(rows)
    n0, n1, n2 = sizes[scale, 0], sizes[scale, 1], sizes[scale, 2]
    for g in range(len(where)):
        i, wi, si = _knot(where[g, 0], n0)
        j, wj, sj = _knot(where[g, 1], n1)
        k, wk, sk = _knot(where[g, 2], n2)
        du, dv, dw = 0.0 * wi, 0.0 * wi, 0.0 * wi
        for c in range(first, last):
            s = slope[g, scale * channels + c]
            p = offsets[scale, 0] + (i * n1 + j) * channels + c
            q = offsets[scale, 1] + (i * n2 + k) * channels + c
            r = offsets[scale, 2] + (j * n2 + k) * channels + c
            low = flat[p] + (flat[p + channels] - flat[p]) * wj
            high = flat[p + n1 * channels]
            high += (flat[p + (n1 + 1) * channels] - high) * wj
            xy, xy_i = low + (high - low) * wi, high - low
            xy_j = (flat[p + channels] - flat[p]) * (1 - wi)
            xy_j += (flat[p + (n1 + 1) * channels] - flat[p + n1 * channels]) * wi
            low = flat[q] + (flat[q + channels] - flat[q]) * wk
            high = flat[q + n2 * channels]
            high += (flat[q + (n2 + 1) * channels] - high) * wk
            xz, xz_i = low + (high - low) * wi, high - low
            xz_k = (flat[q + channels] - flat[q]) * (1 - wi)
            xz_k += (flat[q + (n2 + 1) * channels] - flat[q + n2 * channels]) * wi
            low = flat[r] + (flat[r + channels] - flat[r]) * wk
            high = flat[r + n2 * channels]
            high += (flat[r + (n2 + 1) * channels] - high) * wk
            yz, yz_j = low + (high - low) * wj, high - low
            yz_k = (flat[r + channels] - flat[r]) * (1 - wj)
            yz_k += (flat[r + (n2 + 1) * channels] - flat[r + n2 * channels]) * wj

            space, moved = xy * xz * yz, 0.0 * s
            for which in range(2):
                sign = 1.0 - 2.0 * which
                tx_i = rows[which, 0, i + 1, c] - rows[which, 0, i, c]
                ty_j = rows[which, 1, j + 1, c] - rows[which, 1, j, c]
                tz_k = rows[which, 2, k + 1, c] - rows[which, 2, k, c]
                tx = rows[which, 0, i, c] + tx_i * wi
                ty = rows[which, 1, j, c] + ty_j * wj
                tz = rows[which, 2, k, c] + tz_k * wk
                moved += sign * tx * ty * tz
                to_x, to_y, to_z = (
                    sign * s * space * ty * tz,
                    sign * s * space * tx * tz,
                    sign * s * space * tx * ty,
                )
                to_rows[which, 0, i, c] += to_x * (1 - wi)
                to_rows[which, 0, i + 1, c] += to_x * wi
                to_rows[which, 1, j, c] += to_y * (1 - wj)
                to_rows[which, 1, j + 1, c] += to_y * wj
                to_rows[which, 2, k, c] += to_z * (1 - wk)
                to_rows[which, 2, k + 1, c] += to_z * wk
                du += to_x * tx_i
                dv += to_y * ty_j
                dw += to_z * tz_k
            m = s * moved
            _spread(to_flat, p, channels, n1 * channels, wj, wi, m * xz * yz)
            _spread(to_flat, q, channels, n2 * channels, wk, wi, m * xy * yz)
            _spread(to_flat, r, channels, n2 * channels, wk, wj, m * xy * xz)
            du += m * (xy_i * xz * yz + xy * xz_i * yz)
            dv += m * (xy_j * xz * yz + xy * xz * yz_j)
            dw += m * (xy * xz_k * yz + xy * xz * yz_k)
        to_where[g, 0], to_where[g, 1], to_where[g, 2] = du * si, dv * sj, dw * sk
    k, w, _ = _knot(time, sizes[scale, 3])
    for plane in range(3):
        n, start = sizes[scale, plane], offsets[scale, 3 + plane]
        for i in range(n):
            for c in range(first, last):
                to_flat[start + (k * n + i) * channels + c] += to_rows[0, plane, i, c] * (1 - w)
                to_flat[start + ((k + 1) * n + i) * channels + c] += to_rows[0, plane, i, c] * w
                to_flat[start + i * channels + c] += to_rows[1, plane, i, c]
