"""Laying the ellipses over each other, nearest first, and the gradients of doing so.

    alpha_i = min(0.99, o_i exp(-sigma_i)),  dropped below 1/255
    sigma_i = (x - x_i)^T K_i (x - x_i) / 2
    w_i = alpha_i T_i,  T_i = prod_{j<i} (1 - alpha_j)
    rgb = sum w_i c_i + T background,  depth = sum w_i z_i,  alpha = 1 - T

A pixel takes nothing more once its T is below 1e-4. Kerbl et al., SIGGRAPH 2023 (there the Gaussian that would
bring T below 1e-4 is left out; here it is the last one laid down, which keeps the image's jump below 1e-4).

Each tile is worked by one thread, a Gaussian at a time over the pixels its box reaches, eight to a block so that
the compiler fills its vector registers. Nothing is added across tiles here: gradients stay one row for each
(Gaussian, tile) pair and are summed in the Gaussian's own order, so no result depends on the number of threads.
"""

import numpy as np
from llvmlite import ir
from numba import njit, prange, types
from numba.extending import intrinsic

from surgisim.gaussians.projection import ALPHA_MAX, ALPHA_MIN, BLUE, GREEN, OPACITY, RED, XX, XY, YY, X, Y, Z
from surgisim.gaussians.tiles import TILE

f4 = np.float32
u8 = np.uint64
PIXELS = TILE * TILE
BLOCK = 8
# Unsigned, and one array for all: what Numba needs to know that an index is not negative and nothing overlaps.
L1, L2, L3, L4, L5, L6 = u8(PIXELS), u8(2 * PIXELS), u8(3 * PIXELS), u8(4 * PIXELS), u8(5 * PIXELS), u8(6 * PIXELS)
T_MIN = f4(1e-4)
A_MIN, A_MAX = f4(ALPHA_MIN), f4(ALPHA_MAX)
ONE, ZERO, HALF = f4(1), f4(0), f4(0.5)
# No "nnan" and no "ninf": a NaN must come out as one.
FAST = {"reassoc", "contract", "arcp", "nsz"}

LOG2E, LARGEST = f4(1.4426950408889634), f4(80)
# 2^r on [-1, 0], smallest relative error (7.5e-8).
P0, P1, P2 = f4(9.99999925e-01), f4(6.93142253e-01), f4(2.40172189e-01)
P3, P4, P5 = f4(5.52797222e-02), f4(9.18861128e-03), f4(9.38788161e-04)


@intrinsic
def _float_of_bits(typing_context, bits):
    def code(context, builder, signature, arguments):
        return builder.bitcast(arguments[0], ir.FloatType())

    return types.float32(types.int32), code


@njit(inline="always")
def exp_negative(sigma):
    """exp(-sigma) in float32 for sigma >= 0, relative error below 3e-7 up to 80, in a form that vectorises."""
    x = -LOG2E * (LARGEST if sigma > LARGEST else sigma)
    n = np.int32(x)
    r = x - f4(n)
    p = P0 + r * (P1 + r * (P2 + r * (P3 + r * (P4 + r * P5))))
    return p * _float_of_bits(np.int32((n + np.int32(127)) << np.int32(23)))


@njit(cache=True, parallel=True, fastmath=FAST, error_model="numpy")
def blend(ellipse, box, start, gaussian, number, background, rgb, depth, through, last, weight):
    """Write rgb (H, W, 3), depth [m] and T (H, W), each pixel's last entry (H, W), and each entry's sum of w."""
    height, width = through.shape
    across = -(-width // TILE)
    for t in prange(len(start) - 1):
        left, top = (t % across) * TILE, (t // across) * TILE
        rows, cols = min(TILE, height - top), min(TILE, width - left)
        # T, colour, depth and last of the tile's pixels. T stays 0 where the tile hangs over the image's edge.
        tile = np.zeros(6 * PIXELS, f4)
        for row in range(rows):
            tile[row * TILE : row * TILE + cols] = ONE
        for entry in range(start[t], start[t + 1]):
            if (entry - start[t]) % 32 == 31 and tile[:PIXELS].max() < T_MIN:
                break
            g = gaussian[entry]
            mx, my, z = ellipse[g, X] - f4(left), ellipse[g, Y] - f4(top), ellipse[g, Z]
            a, b, c, o = HALF * ellipse[g, XX], ellipse[g, XY], HALF * ellipse[g, YY], ellipse[g, OPACITY]
            red, green, blue = ellipse[g, RED], ellipse[g, GREEN], ellipse[g, BLUE]
            c0, c1 = (max(box[g, 0], left) - left) // BLOCK, (min(box[g, 1], left + TILE) - 1 - left) // BLOCK
            here, total = f4(entry - start[t] + 1), ZERO
            for row in range(max(box[g, 2], top) - top, min(box[g, 3], top + TILE) - top):
                dy = f4(row) - my
                for col in range(c0, c1 + 1):
                    first, x0 = u8(row * TILE + col * BLOCK), f4(col * BLOCK) - mx
                    for i in range(BLOCK):
                        p, dx = first + u8(i), x0 + f4(i)
                        A = o * exp_negative(dx * (a * dx + b * dy) + c * dy * dy)
                        A = A_MAX if A > A_MAX else A
                        A = ZERO if A < A_MIN else A
                        A = ZERO if tile[p] < T_MIN else A
                        w = A * tile[p]
                        tile[p] -= w
                        tile[p + L1] += w * red
                        tile[p + L2] += w * green
                        tile[p + L3] += w * blue
                        tile[p + L4] += w * z
                        tile[p + L5] = tile[p + L5] if A == ZERO else here
                        total += w
            weight[number[entry]] = total
        for row in range(rows):
            for col in range(cols):
                p, y, x = u8(row * TILE + col), top + row, left + col
                rgb[y, x, 0] = tile[p + L1] + tile[p] * background[0]
                rgb[y, x, 1] = tile[p + L2] + tile[p] * background[1]
                rgb[y, x, 2] = tile[p + L3] + tile[p] * background[2]
                depth[y, x], through[y, x] = tile[p + L4], tile[p]
                last[y, x] = int(tile[p + L5])


@njit(cache=True, parallel=True, fastmath=FAST, error_model="numpy")
def blend_back(ellipse, box, start, gaussian, number, background, through, last, d_rgb, d_depth, d_alpha, d_entry):
    """Write the gradient of each entry's ellipse, (E, 10); `through` and `last` are what `blend` wrote.

    From the farthest to the nearest, with v_i = c_i . d_rgb + z_i d_depth:
        d alpha_i = T_i v_i - (sum_{j>i} w_j v_j + T (background . d_rgb - d_alpha)) / (1 - alpha_i)
    """
    height, width = through.shape
    across = -(-width // TILE)
    for t in prange(len(start) - 1):
        left, top = (t % across) * TILE, (t // across) * TILE
        # T, gradients of colour and depth, last, and the sum behind, of the tile's pixels.
        tile = np.zeros(7 * PIXELS, f4)
        farthest = 0
        for row in range(min(TILE, height - top)):
            for col in range(min(TILE, width - left)):
                p, y, x = u8(row * TILE + col), top + row, left + col
                red, green, blue = d_rgb[y, x, 0], d_rgb[y, x, 1], d_rgb[y, x, 2]
                tile[p], tile[p + L4], tile[p + L5] = through[y, x], d_depth[y, x], last[y, x]
                tile[p + L1], tile[p + L2], tile[p + L3] = red, green, blue
                back = background[0] * red + background[1] * green + background[2] * blue
                tile[p + L6] = through[y, x] * (back - d_alpha[y, x])
                farthest = max(farthest, last[y, x])
        for entry in range(start[t] + farthest - 1, start[t] - 1, -1):
            g = gaussian[entry]
            mx, my, z = ellipse[g, X] - f4(left), ellipse[g, Y] - f4(top), ellipse[g, Z]
            a, b, c, o = HALF * ellipse[g, XX], ellipse[g, XY], HALF * ellipse[g, YY], ellipse[g, OPACITY]
            red, green, blue = ellipse[g, RED], ellipse[g, GREEN], ellipse[g, BLUE]
            c0, c1 = (max(box[g, 0], left) - left) // BLOCK, (min(box[g, 1], left + TILE) - 1 - left) // BLOCK
            here = f4(entry - start[t] + 1)
            wR, wG, wB, wZ = ZERO, ZERO, ZERO, ZERO
            q, qx, qy, qxx, qxy, qyy = ZERO, ZERO, ZERO, ZERO, ZERO, ZERO
            for row in range(max(box[g, 2], top) - top, min(box[g, 3], top + TILE) - top):
                dy = f4(row) - my
                s, sx, sxx = ZERO, ZERO, ZERO
                for col in range(c0, c1 + 1):
                    first, x0 = u8(row * TILE + col * BLOCK), f4(col * BLOCK) - mx
                    for i in range(BLOCK):
                        p, dx = first + u8(i), x0 + f4(i)
                        A = o * exp_negative(dx * (a * dx + b * dy) + c * dy * dy)
                        held = A > A_MAX
                        A = A_MAX if held else A
                        A = ZERO if A < A_MIN else A
                        A = ZERO if tile[p + L5] < here else A
                        clear = ONE / (ONE - A)
                        before = tile[p] * clear
                        w = A * before
                        v = red * tile[p + L1] + green * tile[p + L2] + blue * tile[p + L3] + z * tile[p + L4]
                        # -alpha d alpha = d sigma; none where alpha is held at its largest.
                        m = A * (tile[p + L6] * clear - before * v)
                        m = ZERO if held else m
                        tile[p + L6] += w * v
                        tile[p] = before
                        wR += w * tile[p + L1]
                        wG += w * tile[p + L2]
                        wB += w * tile[p + L3]
                        wZ += w * tile[p + L4]
                        s += m
                        sx += m * dx
                        sxx += m * dx * dx
                q += s
                qx += sx
                qxx += sxx
                qy += s * dy
                qxy += sx * dy
                qyy += s * dy * dy
            n = number[entry]
            d_entry[n, X], d_entry[n, Y] = -(f4(2) * a * qx + b * qy), -(b * qx + f4(2) * c * qy)
            d_entry[n, XX], d_entry[n, XY], d_entry[n, YY] = HALF * qxx, qxy, HALF * qyy
            d_entry[n, OPACITY] = -q / o
            d_entry[n, RED], d_entry[n, GREEN], d_entry[n, BLUE], d_entry[n, Z] = wR, wG, wB, wZ


@njit(cache=True, parallel=True)
def gather(first, entries, total):
    """Write each Gaussian's sum over its entries, in their own order, in float64: (E, C) to (G, C)."""
    for g in prange(len(first) - 1):
        for k in range(entries.shape[1]):
            s = 0.0
            for n in range(first[g], first[g + 1]):
                s += entries[n, k]
            total[g, k] = s
