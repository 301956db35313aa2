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

from surgisim.gaussians.projection import ALPHA_MAX, ALPHA_MIN
from surgisim.gaussians.tiles import TILE

f4 = np.float32
PIXELS = TILE * TILE
BLOCK = 8
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
        T = np.zeros(PIXELS, f4)  # stays 0 where the tile hangs over the image's edge
        for row in range(min(TILE, height - top)):
            T[row * TILE : row * TILE + min(TILE, width - left)] = ONE
        layers = np.zeros(4 * PIXELS, f4)
        final = np.full(PIXELS, -1, np.int32)
        for entry in range(start[t], start[t + 1]):
            if (entry - start[t]) % 32 == 31 and T.max() < T_MIN:
                break
            g = gaussian[entry]
            mx, my, z = ellipse[g, 0] - f4(left), ellipse[g, 1] - f4(top), ellipse[g, 9]
            a, b, c, o = HALF * ellipse[g, 2], ellipse[g, 3], HALF * ellipse[g, 4], ellipse[g, 5]
            red, green, blue = ellipse[g, 6], ellipse[g, 7], ellipse[g, 8]
            c0, c1 = (max(box[g, 0], left) - left) // BLOCK, (min(box[g, 1], left + TILE) - 1 - left) // BLOCK
            total = ZERO
            here = np.int32(entry)
            for row in range(max(box[g, 2], top) - top, min(box[g, 3], top + TILE) - top):
                dy = f4(row) - my
                for col in range(c0, c1 + 1):
                    p0 = row * TILE + col * BLOCK
                    x0 = f4(col * BLOCK) - mx
                    tT, tF = T[p0 : p0 + BLOCK], final[p0 : p0 + BLOCK]
                    tR, tG = layers[p0 : p0 + BLOCK], layers[p0 + PIXELS : p0 + PIXELS + BLOCK]
                    tB = layers[p0 + 2 * PIXELS : p0 + 2 * PIXELS + BLOCK]
                    tZ = layers[p0 + 3 * PIXELS : p0 + 3 * PIXELS + BLOCK]
                    for i in range(BLOCK):
                        dx = x0 + f4(i)
                        A = o * exp_negative(dx * (a * dx + b * dy) + c * dy * dy)
                        A = A_MAX if A > A_MAX else A
                        A = ZERO if A < A_MIN else A
                        A = ZERO if tT[i] < T_MIN else A
                        w = A * tT[i]
                        tF[i] = tF[i] if A == ZERO else here
                        tT[i] -= w
                        tR[i] += w * red
                        tG[i] += w * green
                        tB[i] += w * blue
                        tZ[i] += w * z
                        total += w
            weight[number[entry]] = total
        for row in range(min(TILE, height - top)):
            for col in range(min(TILE, width - left)):
                p = row * TILE + col
                for k in range(3):
                    rgb[top + row, left + col, k] = layers[p + k * PIXELS] + T[p] * background[k]
                depth[top + row, left + col] = layers[p + 3 * PIXELS]
                through[top + row, left + col] = T[p]
                last[top + row, left + col] = final[p]


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
        T = np.ones(PIXELS, f4)
        behind = np.zeros(PIXELS, f4)
        final = np.full(PIXELS, -1, np.int32)
        d = np.zeros(4 * PIXELS, f4)
        for row in range(min(TILE, height - top)):
            for col in range(min(TILE, width - left)):
                p, y, x = row * TILE + col, top + row, left + col
                T[p], final[p] = through[y, x], last[y, x]
                for k in range(3):
                    d[p + k * PIXELS] = d_rgb[y, x, k]
                    behind[p] += background[k] * d_rgb[y, x, k]
                d[p + 3 * PIXELS] = d_depth[y, x]
                behind[p] = T[p] * (behind[p] - d_alpha[y, x])
        farthest = final.max()
        for entry in range(start[t + 1] - 1, start[t] - 1, -1):
            if entry > farthest:
                continue
            g = gaussian[entry]
            mx, my, z = ellipse[g, 0] - f4(left), ellipse[g, 1] - f4(top), ellipse[g, 9]
            a, b, c, o = HALF * ellipse[g, 2], ellipse[g, 3], HALF * ellipse[g, 4], ellipse[g, 5]
            red, green, blue = ellipse[g, 6], ellipse[g, 7], ellipse[g, 8]
            c0, c1 = (max(box[g, 0], left) - left) // BLOCK, (min(box[g, 1], left + TILE) - 1 - left) // BLOCK
            here = np.int32(entry)
            wR, wG, wB, wZ = ZERO, ZERO, ZERO, ZERO
            q, qx, qy, qxx, qxy, qyy = ZERO, ZERO, ZERO, ZERO, ZERO, ZERO
            for row in range(max(box[g, 2], top) - top, min(box[g, 3], top + TILE) - top):
                dy = f4(row) - my
                s, sx, sxx = ZERO, ZERO, ZERO
                for col in range(c0, c1 + 1):
                    p0 = row * TILE + col * BLOCK
                    x0 = f4(col * BLOCK) - mx
                    tT, tF, tS = T[p0 : p0 + BLOCK], final[p0 : p0 + BLOCK], behind[p0 : p0 + BLOCK]
                    tR, tG = d[p0 : p0 + BLOCK], d[p0 + PIXELS : p0 + PIXELS + BLOCK]
                    tB = d[p0 + 2 * PIXELS : p0 + 2 * PIXELS + BLOCK]
                    tZ = d[p0 + 3 * PIXELS : p0 + 3 * PIXELS + BLOCK]
                    for i in range(BLOCK):
                        dx = x0 + f4(i)
                        A = o * exp_negative(dx * (a * dx + b * dy) + c * dy * dy)
                        held = A > A_MAX
                        A = A_MAX if held else A
                        A = ZERO if A < A_MIN else A
                        A = ZERO if tF[i] < here else A
                        clear = ONE / (ONE - A)
                        before = tT[i] * clear
                        v = red * tR[i] + green * tG[i] + blue * tB[i] + z * tZ[i]
                        w = A * before
                        # -alpha d alpha = d sigma; none where alpha is held at its largest.
                        m = A * (tS[i] * clear - before * v)
                        m = ZERO if held else m
                        tS[i] += w * v
                        tT[i] = before
                        wR += w * tR[i]
                        wG += w * tG[i]
                        wB += w * tB[i]
                        wZ += w * tZ[i]
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
            d_entry[n, 0], d_entry[n, 1] = -(f4(2) * a * qx + b * qy), -(b * qx + f4(2) * c * qy)
            d_entry[n, 2], d_entry[n, 3], d_entry[n, 4] = HALF * qxx, qxy, HALF * qyy
            d_entry[n, 5] = -q / o
            d_entry[n, 6], d_entry[n, 7], d_entry[n, 8], d_entry[n, 9] = wR, wG, wB, wZ


@njit(cache=True, parallel=True)
def gather(first, entries, total):
    """Write each Gaussian's sum over its entries, in their own order, in float64: (E, C) to (G, C)."""
    for g in prange(len(first) - 1):
        for k in range(entries.shape[1]):
            s = 0.0
            for n in range(first[g], first[g + 1]):
                s += entries[n, k]
            total[g, k] = s
