"""From Gaussians in space to ellipses in the image, and the way back for gradients.

    x' = fx x/z + cx,  y' = fy y/z + cy                               [px]
    cov' = J R S S^T R^T J^T + 0.3 I                                  [px^2]
    J = [[fx/z, 0, -fx u/z], [0, fy/z, -fy v/z]],  u = x/z,  v = y/z  [px/m]

u and v in J are held within the view plus 30 % of its half width: far outside, the linearised projection of a
Gaussian that never reaches the image would stretch back into it.

Zwicker, Pfister, van Baar and Gross, EWA volume splatting, IEEE VIS 2001; Kerbl, Kopanas, Leimkuehler and
Drettakis, 3D Gaussian splatting for real-time radiance field rendering, SIGGRAPH 2023.
"""

import math

from numba import njit, prange

LOW_PASS = 0.3
"""Added to the variance of every ellipse [px^2]: none is thinner than a pixel."""
ALPHA_MIN = 1.0 / 255.0
"""A Gaussian thinner than this at a pixel is not there."""
ALPHA_MAX = 0.99
"""No Gaussian hides what is behind it altogether, so that gradients reach there."""
X, Y, XX, XY, YY, OPACITY, RED, GREEN, BLUE, Z = range(10)
"""Columns of an ellipse: centre [px], inverse covariance [1/px^2], opacity, colour, depth [m]."""


@njit(cache=True, parallel=True, error_model="numpy")
def project(mean, rotation, scale, opacity, color, lens, near, ellipse, box):
    """Write each Gaussian's ellipse (G, 10) and the pixels it reaches, x0 x1 y0 y1 with ends left out, (G, 4).

    `lens` is fx, fy, cx, cy, width, height [px]. A Gaussian behind `near` [m], out of view, or thinner than
    ALPHA_MIN everywhere gets an empty box.
    """
    for g in prange(len(mean)):
        R = _matrix(float(rotation[g, 0]), float(rotation[g, 1]), float(rotation[g, 2]), float(rotation[g, 3]))
        S = (float(scale[g, 0]), float(scale[g, 1]), float(scale[g, 2]))
        _write(g, mean, R, S, opacity, color, lens, near, ellipse, box)


@njit(cache=True, parallel=True, error_model="numpy")
def project_factors(mean, factor, opacity, color, lens, near, ellipse, box):
    """As `project` for Gaussians of covariance M M^T, M being `factor` (G, 3, 3) [m]."""
    for g in prange(len(mean)):
        M = (
            (float(factor[g, 0, 0]), float(factor[g, 0, 1]), float(factor[g, 0, 2])),
            (float(factor[g, 1, 0]), float(factor[g, 1, 1]), float(factor[g, 1, 2])),
            (float(factor[g, 2, 0]), float(factor[g, 2, 1]), float(factor[g, 2, 2])),
        )
        _write(g, mean, M, (1.0, 1.0, 1.0), opacity, color, lens, near, ellipse, box)


@njit(cache=True, error_model="numpy")
def _write(g, mean, R, S, opacity, color, lens, near, ellipse, box):
    """One Gaussian's ellipse and box; R S is what its covariance is the square of, R any three rows."""
    fx, fy, cx, cy, width, height = lens
    box[g, 0] = box[g, 1] = box[g, 2] = box[g, 3] = 0
    x, y, z = float(mean[g, 0]), float(mean[g, 1]), float(mean[g, 2])
    if z < near or opacity[g] < ALPHA_MIN:
        return
    a, b, c = _covariance(*_axes(R, S, *_slope(x / z, y / z, fx, fy, cx, cy, width, height), fx / z, fy / z))
    det = a * c - b * b
    px, py = fx * x / z + cx, fy * y / z + cy
    # Where opacity * exp(-sigma) falls to ALPHA_MIN the ellipse ends; the box is exact, not a multiple of sigma.
    reach = 2.0 * math.log(float(opacity[g]) / ALPHA_MIN)
    wide, high = math.sqrt(reach * a), math.sqrt(reach * c)
    x0, x1 = max(0.0, math.ceil(px - wide)), min(width - 1.0, math.floor(px + wide))
    y0, y1 = max(0.0, math.ceil(py - high)), min(height - 1.0, math.floor(py + high))
    if x0 > x1 or y0 > y1:
        return
    box[g, 0], box[g, 1], box[g, 2], box[g, 3] = int(x0), int(x1) + 1, int(y0), int(y1) + 1
    ellipse[g, X], ellipse[g, Y], ellipse[g, Z] = px, py, z
    ellipse[g, XX], ellipse[g, XY], ellipse[g, YY] = c / det, -b / det, a / det
    ellipse[g, OPACITY] = opacity[g]
    ellipse[g, RED], ellipse[g, GREEN], ellipse[g, BLUE] = color[g, 0], color[g, 1], color[g, 2]


@njit(cache=True, parallel=True, error_model="numpy")
def project_back(mean, rotation, scale, lens, box, d_ellipse, d_mean, d_rotation, d_scale, d_opacity, d_color):
    """Write the gradients of the five attributes, given those of the ellipses, (G, 10)."""
    fx, fy, cx, cy, width, height = lens
    for g in prange(len(mean)):
        d_mean[g, 0] = d_mean[g, 1] = d_mean[g, 2] = 0
        d_scale[g, 0] = d_scale[g, 1] = d_scale[g, 2] = 0
        d_rotation[g, 0] = d_rotation[g, 1] = d_rotation[g, 2] = d_rotation[g, 3] = 0
        d_opacity[g] = d_color[g, 0] = d_color[g, 1] = d_color[g, 2] = 0
        if box[g, 0] == box[g, 1]:
            continue
        d_opacity[g] = d_ellipse[g, OPACITY]
        d_color[g, 0], d_color[g, 1], d_color[g, 2] = d_ellipse[g, RED], d_ellipse[g, GREEN], d_ellipse[g, BLUE]
        x, y, z = float(mean[g, 0]), float(mean[g, 1]), float(mean[g, 2])
        q = (float(rotation[g, 0]), float(rotation[g, 1]), float(rotation[g, 2]), float(rotation[g, 3]))
        S = (float(scale[g, 0]), float(scale[g, 1]), float(scale[g, 2]))
        R = _matrix(*q)
        u, v = _slope(x / z, y / z, fx, fy, cx, cy, width, height)
        j, k = fx / z, fy / z
        V0, V1 = _axes(R, S, u, v, j, k)
        a, b, c = _covariance(V0, V1)
        det = a * c - b * b
        p, m, n = c / det, -b / det, a / det
        # d cov = -K dK K, with K = [[p, m], [m, n]] and dK = [[e, h/2], [h/2, f]]
        e, h, f = float(d_ellipse[g, XX]), float(d_ellipse[g, XY]), float(d_ellipse[g, YY])
        d_a = -(p * p * e + p * m * h + m * m * f)
        d_b = -(2.0 * p * m * e + (p * n + m * m) * h + 2.0 * m * n * f)
        d_c = -(m * m * e + m * n * h + n * n * f)
        d_J00, d_J02, d_J11, d_J12 = 0.0, 0.0, 0.0, 0.0
        d_w, d_x, d_y, d_z = 0.0, 0.0, 0.0, 0.0
        for i in range(3):
            d_0, d_1 = 2.0 * d_a * V0[i] + d_b * V1[i], 2.0 * d_c * V1[i] + d_b * V0[i]
            # Column i of d(R S): J^T dV, with J = [[j, 0, -j u], [0, k, -k v]].
            d_M0, d_M1, d_M2 = j * d_0, k * d_1, -(j * u * d_0 + k * v * d_1)
            d_scale[g, i] = d_M0 * R[0][i] + d_M1 * R[1][i] + d_M2 * R[2][i]
            d_J00 += d_0 * R[0][i] * S[i]
            d_J02 += d_0 * R[2][i] * S[i]
            d_J11 += d_1 * R[1][i] * S[i]
            d_J12 += d_1 * R[2][i] * S[i]
            turn = _turn(q, i, d_M0 * S[i], d_M1 * S[i], d_M2 * S[i])
            d_w, d_x, d_y, d_z = d_w + turn[0], d_x + turn[1], d_y + turn[2], d_z + turn[3]
        d_rotation[g, 0], d_rotation[g, 1], d_rotation[g, 2], d_rotation[g, 3] = d_w, d_x, d_y, d_z

        d_px, d_py = j * d_ellipse[g, X], k * d_ellipse[g, Y]
        depth = d_ellipse[g, Z] - (d_px * x + d_py * y) / z
        depth += (-j * d_J00 + j * u * d_J02 - k * d_J11 + k * v * d_J12) / z
        if u == x / z:
            d_px -= j * d_J02 / z
            depth += j * d_J02 * u / z
        if v == y / z:
            d_py -= k * d_J12 / z
            depth += k * d_J12 * v / z
        d_mean[g, 0], d_mean[g, 1], d_mean[g, 2] = d_px, d_py, depth


@njit(cache=True, error_model="numpy")
def _matrix(w, x, y, z):
    """Rows of the rotation of a quaternion of any length."""
    n = 2.0 / (w * w + x * x + y * y + z * z)
    xx, yy, zz, xy, xz, yz, wx, wy, wz = x * x, y * y, z * z, x * y, x * z, y * z, w * x, w * y, w * z
    return (
        (1.0 - n * (yy + zz), n * (xy - wz), n * (xz + wy)),
        (n * (xy + wz), 1.0 - n * (xx + zz), n * (yz - wx)),
        (n * (xz - wy), n * (yz + wx), 1.0 - n * (xx + yy)),
    )


@njit(cache=True, error_model="numpy")
def _turn(q, i, d_0, d_1, d_2):
    """Gradient of the quaternion, of any length, from that of column i of its matrix.

    The matrix is 1 + n B with n = 2/|q|^2 and B quadratic in q, so that d = n B' - (n^2 B) q.
    """
    w, x, y, z = q
    n = 2.0 / (w * w + x * x + y * y + z * z)
    if i == 0:
        B = -(y * y + z * z) * d_0 + (x * y + w * z) * d_1 + (x * z - w * y) * d_2
        d = z * d_1 - y * d_2, y * d_1 + z * d_2, -2 * y * d_0 + x * d_1 - w * d_2, -2 * z * d_0 + w * d_1 + x * d_2
    elif i == 1:
        B = (x * y - w * z) * d_0 - (x * x + z * z) * d_1 + (y * z + w * x) * d_2
        d = x * d_2 - z * d_0, y * d_0 - 2 * x * d_1 + w * d_2, x * d_0 + z * d_2, -w * d_0 - 2 * z * d_1 + y * d_2
    else:
        B = (x * z + w * y) * d_0 + (y * z - w * x) * d_1 - (x * x + y * y) * d_2
        d = y * d_0 - x * d_1, z * d_0 - w * d_1 - 2 * x * d_2, w * d_0 + z * d_1 - 2 * y * d_2, x * d_0 + y * d_1
    shrink = n * n * B
    return n * d[0] - shrink * w, n * d[1] - shrink * x, n * d[2] - shrink * y, n * d[3] - shrink * z


@njit(cache=True, error_model="numpy")
def _slope(u, v, fx, fy, cx, cy, width, height):
    """x/z and y/z as the linearised projection uses them."""
    u = min(max(u, -(cx + 0.15 * width) / fx), (width - cx + 0.15 * width) / fx)
    return u, min(max(v, -(cy + 0.15 * height) / fy), (height - cy + 0.15 * height) / fy)


@njit(cache=True, error_model="numpy")
def _axes(R, S, u, v, j, k):
    """The two rows of J R S."""
    return (
        (j * (R[0][0] - u * R[2][0]) * S[0], j * (R[0][1] - u * R[2][1]) * S[1], j * (R[0][2] - u * R[2][2]) * S[2]),
        (k * (R[1][0] - v * R[2][0]) * S[0], k * (R[1][1] - v * R[2][1]) * S[1], k * (R[1][2] - v * R[2][2]) * S[2]),
    )


@njit(cache=True, error_model="numpy")
def _covariance(V0, V1):
    """xx, xy, yy of J R S S^T R^T J^T + low pass [px^2]."""
    a = V0[0] * V0[0] + V0[1] * V0[1] + V0[2] * V0[2] + LOW_PASS
    c = V1[0] * V1[0] + V1[1] * V1[1] + V1[2] * V1[2] + LOW_PASS
    return a, V0[0] * V1[0] + V0[1] * V1[1] + V0[2] * V1[2], c
