"""Reading the feature planes and giving slopes back to them, compiled.

The backward pass is split over blocks of channels: no two tasks write to the same number, so the sums do not depend on
the number of threads.
"""

import numpy as np
from numba import njit, prange

BLOCK = 8
"""Channels that one task of the backward pass owns."""


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
def shares(time, n, cubic):
    """How much of each of n knots is read at `time`, 0-1, (n,): in straight lines between them, or by a cubic B-spline.

    Beyond its ends a spline goes on along the line through the last two knots, so it begins at the first knot and ends
    at the last one, without bending there (de Boor, A practical guide to splines, 1978).
    """
    k, w, _ = _knot(time, n)
    found = np.zeros(n)
    if not cubic:
        found[k], found[k + 1] = 1 - w, w
        return found
    basis = (1 - w) ** 3 / 6, (4 - 6 * w**2 + 3 * w**3) / 6, (1 + 3 * w + 3 * w**2 - 3 * w**3) / 6, w**3 / 6
    for tap in range(4):
        knot, share = k - 1 + tap, basis[tap]
        if knot < 0:
            found[0] += 2 * share
            found[1] -= share
        elif knot >= n:
            found[n - 1] += 2 * share
            found[n - 2] -= share
        else:
            found[knot] += share
    return found


@njit(cache=True)
def _rows(flat, time, sizes, offsets, channels, scale, cubic):
    """The three time planes at `time` and at 0, (2, 3, longest, C)."""
    longest = max(sizes[scale, 0], sizes[scale, 1], sizes[scale, 2])
    rows = np.zeros((2, 3, longest, channels), flat.dtype)
    share = shares(time, sizes[scale, 3], cubic)
    for p in range(3):
        n, start = sizes[scale, p], offsets[scale, 3 + p]
        rows[1, p, :n] = flat[start : start + n * channels].reshape(n, channels)
        for k in np.flatnonzero(share):
            first = start + k * n * channels
            rows[0, p, :n] += share[k] * flat[first : first + n * channels].reshape(n, channels)
    return rows


@njit(cache=True, parallel=True)
def read(flat, where, time, sizes, offsets, channels, cubic, out):
    """Features of all points into `out`, (G, L C); see `planes.features`."""
    for scale in range(len(sizes)):
        rows = _rows(flat, time, sizes, offsets, channels, scale, cubic)
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
def give_back(flat, where, time, sizes, offsets, channels, cubic, slope, to_flat, to_where):
    """Slopes of the features (G, L C), added to those of the planes and, one a task, of the points (tasks, G, 3)."""
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
            cubic,
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
def _backward_block(flat, where, time, sizes, offsets, channels, cubic, slope, scale, first, last, to_flat, to_where):
    rows = _rows(flat, time, sizes, offsets, channels, scale, cubic)
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
    share = shares(time, sizes[scale, 3], cubic)
    read_from = np.flatnonzero(share)
    for plane in range(3):
        n, start = sizes[scale, plane], offsets[scale, 3 + plane]
        for i in range(n):
            for c in range(first, last):
                to_flat[start + i * channels + c] += to_rows[1, plane, i, c]
                for k in read_from:
                    to_flat[start + (k * n + i) * channels + c] += to_rows[0, plane, i, c] * share[k]
