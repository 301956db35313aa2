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

import numpy as np
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
    fx, fy, cx, cy, width, height = lens
    for g in prange(len(mean)):
        box[g, 0] = box[g, 1] = box[g, 2] = box[g, 3] = 0
        z = float(mean[g, 2])
        if z < near or opacity[g] < ALPHA_MIN:
            continue
        x, y = float(mean[g, 0]), float(mean[g, 1])
        V, _, _, _, _, _ = _view(x, y, z, rotation[g], scale[g], lens)
        a = V[0, 0] ** 2 + V[0, 1] ** 2 + V[0, 2] ** 2 + LOW_PASS
        b = V[0, 0] * V[1, 0] + V[0, 1] * V[1, 1] + V[0, 2] * V[1, 2]
        c = V[1, 0] ** 2 + V[1, 1] ** 2 + V[1, 2] ** 2 + LOW_PASS
        det = a * c - b * b
        px, py = fx * x / z + cx, fy * y / z + cy
        # Where opacity * exp(-sigma) falls to ALPHA_MIN the ellipse ends; the box is exact, not a multiple of sigma.
        reach = 2.0 * math.log(float(opacity[g]) / ALPHA_MIN)
        wide, high = math.sqrt(reach * a), math.sqrt(reach * c)
        x0, x1 = max(0.0, math.ceil(px - wide)), min(width - 1.0, math.floor(px + wide))
        y0, y1 = max(0.0, math.ceil(py - high)), min(height - 1.0, math.floor(py + high))
        if x0 > x1 or y0 > y1:
            continue
        box[g, 0], box[g, 1], box[g, 2], box[g, 3] = int(x0), int(x1) + 1, int(y0), int(y1) + 1
        ellipse[g, X], ellipse[g, Y], ellipse[g, Z] = px, py, z
        ellipse[g, XX], ellipse[g, XY], ellipse[g, YY] = c / det, -b / det, a / det
        ellipse[g, OPACITY] = opacity[g]
        ellipse[g, RED], ellipse[g, GREEN], ellipse[g, BLUE] = color[g, 0], color[g, 1], color[g, 2]


@njit(cache=True, parallel=True, error_model="numpy")
def project_back(mean, rotation, scale, lens, box, d_ellipse, d_mean, d_rotation, d_scale, d_opacity, d_color):
    """Write the gradients of the five attributes, given those of the ellipses, (G, 10)."""
    fx, fy = lens[0], lens[1]
    for g in prange(len(mean)):
        d_mean[g] = 0
        d_rotation[g] = 0
        d_scale[g] = 0
        d_color[g] = 0
        d_opacity[g] = 0
        if box[g, 0] == box[g, 1]:
            continue
        d_opacity[g] = d_ellipse[g, OPACITY]
        d_color[g, 0], d_color[g, 1], d_color[g, 2] = d_ellipse[g, RED], d_ellipse[g, GREEN], d_ellipse[g, BLUE]
        x, y, z = float(mean[g, 0]), float(mean[g, 1]), float(mean[g, 2])
        V, J, R, q, u, v = _view(x, y, z, rotation[g], scale[g], lens)
        a = V[0, 0] ** 2 + V[0, 1] ** 2 + V[0, 2] ** 2 + LOW_PASS
        b = V[0, 0] * V[1, 0] + V[0, 1] * V[1, 1] + V[0, 2] * V[1, 2]
        c = V[1, 0] ** 2 + V[1, 1] ** 2 + V[1, 2] ** 2 + LOW_PASS
        det = a * c - b * b
        k, m, n = c / det, -b / det, a / det
        # d cov = -K dK K, with K = [[k, m], [m, n]] and dK = [[e, h/2], [h/2, f]]
        e, h, f = float(d_ellipse[g, XX]), float(d_ellipse[g, XY]), float(d_ellipse[g, YY])
        d_a = -(k * k * e + k * m * h + m * m * f)
        d_b = -(2.0 * k * m * e + (k * n + m * m) * h + 2.0 * m * n * f)
        d_c = -(m * m * e + m * n * h + n * n * f)
        d_V = np.empty((2, 3))
        for i in range(3):
            d_V[0, i] = 2.0 * d_a * V[0, i] + d_b * V[1, i]
            d_V[1, i] = 2.0 * d_c * V[1, i] + d_b * V[0, i]
        d_J = np.zeros((2, 3))
        d_R = np.empty((3, 3))
        for i in range(3):
            s = float(scale[g, i])
            total = 0.0
            for r in range(3):
                d_M = J[0, r] * d_V[0, i] + J[1, r] * d_V[1, i]
                total += d_M * R[r, i]
                d_R[r, i] = d_M * s
                d_J[0, r] += d_V[0, i] * R[r, i] * s
                d_J[1, r] += d_V[1, i] * R[r, i] * s
            d_scale[g, i] = total
        _turn_back(d_R, q, rotation[g], d_rotation[g])
        d_x = fx / z * d_ellipse[g, X]
        d_y = fy / z * d_ellipse[g, Y]
        d_z = d_ellipse[g, Z] - (d_x * x + d_y * y) / z
        d_z += (-fx * d_J[0, 0] + fx * u * d_J[0, 2] - fy * d_J[1, 1] + fy * v * d_J[1, 2]) / (z * z)
        d_u, d_v = -fx / z * d_J[0, 2], -fy / z * d_J[1, 2]
        if u == x / z:
            d_x += d_u / z
            d_z -= d_u * u / z
        if v == y / z:
            d_y += d_v / z
            d_z -= d_v * v / z
        d_mean[g, 0], d_mean[g, 1], d_mean[g, 2] = d_x, d_y, d_z


@njit(cache=True, error_model="numpy")
def _view(x, y, z, rotation, scale, lens):
    """V = J R S (2, 3), J (2, 3), R (3, 3), the unit quaternion, and u, v as J uses them; all in float64."""
    fx, fy, cx, cy, width, height = lens
    u = min(max(x / z, -cx / fx - 0.15 * width / fx), (width - cx) / fx + 0.15 * width / fx)
    v = min(max(y / z, -cy / fy - 0.15 * height / fy), (height - cy) / fy + 0.15 * height / fy)
    J = np.zeros((2, 3))
    J[0, 0], J[0, 2] = fx / z, -fx * u / z
    J[1, 1], J[1, 2] = fy / z, -fy * v / z
    q = rotation.astype(np.float64)
    q /= math.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    w, i, j, k = q
    R = np.empty((3, 3))
    R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (j * j + k * k), 2 * (i * j - w * k), 2 * (i * k + w * j)
    R[1, 0], R[1, 1], R[1, 2] = 2 * (i * j + w * k), 1 - 2 * (i * i + k * k), 2 * (j * k - w * i)
    R[2, 0], R[2, 1], R[2, 2] = 2 * (i * k - w * j), 2 * (j * k + w * i), 1 - 2 * (i * i + j * j)
    V = np.empty((2, 3))
    for col in range(3):
        s = float(scale[col])
        V[0, col] = (J[0, 0] * R[0, col] + J[0, 2] * R[2, col]) * s
        V[1, col] = (J[1, 1] * R[1, col] + J[1, 2] * R[2, col]) * s
    return V, J, R, q, u, v


@njit(cache=True, error_model="numpy")
def _turn_back(d_R, q, rotation, d_rotation):
    """Gradient of the quaternion as stored, not yet of unit length, from that of its matrix."""
    w, i, j, k = q
    d = np.empty(4)
    d[0] = 2 * (k * (d_R[1, 0] - d_R[0, 1]) + j * (d_R[0, 2] - d_R[2, 0]) + i * (d_R[2, 1] - d_R[1, 2]))
    d[1] = 2 * (
        j * (d_R[0, 1] + d_R[1, 0])
        + k * (d_R[0, 2] + d_R[2, 0])
        + w * (d_R[2, 1] - d_R[1, 2])
        - 2 * i * (d_R[1, 1] + d_R[2, 2])
    )
    d[2] = 2 * (
        i * (d_R[0, 1] + d_R[1, 0])
        + k * (d_R[1, 2] + d_R[2, 1])
        + w * (d_R[0, 2] - d_R[2, 0])
        - 2 * j * (d_R[0, 0] + d_R[2, 2])
    )
    d[3] = 2 * (
        i * (d_R[0, 2] + d_R[2, 0])
        + j * (d_R[1, 2] + d_R[2, 1])
        + w * (d_R[1, 0] - d_R[0, 1])
        - 2 * k * (d_R[0, 0] + d_R[1, 1])
    )
    along = d[0] * w + d[1] * i + d[2] * j + d[3] * k
    length = 0.0
    for n in range(4):
        length += float(rotation[n]) ** 2
    length = math.sqrt(length)
    for n in range(4):
        d_rotation[n] = (d[n] - along * q[n]) / length
