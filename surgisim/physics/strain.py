"""Strain as the laws measure it: smooth at rest, where every particle starts.

e = dev (C - I) (C + I)^-1, C = F^T F, whose eigenvalues are tanh(ln stretch): the logarithmic strain without a
logarithm. Its size is von Mises' equivalent strain, sqrt(2/3 e : e): the stretch of a bar of constant volume.
Each function has its float64 numpy form beside it, by another route where there is one.
"""

from typing import Any

import numpy as np
import warp as wp

SMALL = 1e-6
"""Size below which a strain counts as none: keeps the slope of a size finite at rest."""

WORKING_STRETCH = 1.3
"""Stretch up to which a law that stiffens states its modulus for the stable step."""


@wp.func
def deviator(A: Any):
    return A - (wp.trace(A) / A.dtype(3.0)) * wp.identity(n=3, dtype=A.dtype)


@wp.func
def packed(A: Any):
    """Five numbers of a symmetric tensor without trace."""
    return wp.vector(A[0, 0], A[1, 1], A[0, 1], A[0, 2], A[1, 2], dtype=A.dtype)


@wp.func
def unpacked(q: Any):
    """The tensor of the first five numbers."""
    return wp.matrix(q[0], q[2], q[3], q[2], q[1], q[4], q[3], q[4], -q[0] - q[1], shape=(3, 3), dtype=q.dtype)


@wp.func
def strain(F: Any):
    """e, of no dimension."""
    one = wp.identity(n=3, dtype=F.dtype)
    return F.dtype(-2.0) * deviator(wp.inverse(wp.transpose(F) * F + one))


@wp.func
def size(e: Any):
    """Equivalent strain."""
    small = e.dtype(SMALL)
    return wp.sqrt(e.dtype(2.0) / e.dtype(3.0) * wp.ddot(e, e) + small * small) - small


@wp.func
def ramp(x: Any, width: Any):
    """0 below 0, x far above `width`, and twice differentiable between: x^3 / (x^2 + width^2)."""
    up = wp.max(x, x - x)
    return up * up * up / (up * up + width * width)


@wp.func
def exponential(A: Any):
    """exp(A) of a symmetric tensor without trace, |A| below about 2, of determinant one."""
    # Without trace A^3 = m A + d I, so every power is a I + b A + c A^2 and the series is one of numbers.
    m, d = A.dtype(0.5) * wp.ddot(A, A), wp.determinant(A)
    zero = A.dtype(0.0)
    a, b, c = A.dtype(1.0), zero, zero
    sum_a, sum_b, sum_c = A.dtype(1.0), zero, zero
    for n in range(1, 17):
        share = A.dtype(1.0) / A.dtype(n)
        a, b, c = share * (c * d), share * (a + c * m), share * b
        sum_a += a
        sum_b += b
        sum_c += c
    return sum_a * wp.identity(n=3, dtype=A.dtype) + sum_b * A + sum_c * (A * A)


def twin_deviator(A):
    return A - np.trace(A, axis1=-2, axis2=-1)[..., None, None] / 3 * np.eye(3)


def twin_packed(A):
    return A[..., [0, 1, 0, 0, 1], [0, 1, 1, 2, 2]]


def twin_unpacked(q):
    xx, yy, xy, xz, yz = np.moveaxis(np.asarray(q)[..., :5], -1, 0)
    return np.stack([xx, xy, xz, xy, yy, yz, xz, yz, -xx - yy], -1).reshape(*xx.shape, 3, 3)


def twin_strain(F):
    C = np.swapaxes(F, -1, -2) @ F
    # tanh(log(x) / 2) = (x - 1) / (x + 1), and tensors of the same axes commute.
    return twin_deviator(np.linalg.solve(C + np.eye(3), C - np.eye(3)))


def twin_size(e):
    return np.sqrt(2 / 3 * (e**2).sum((-1, -2)) + SMALL**2) - SMALL


def twin_ramp(x, width):
    return np.where(x > 0, x**3 / (x**2 + width**2), 0.0)


def twin_exponential(A):
    return of_eigenvalues(A, np.exp)


def of_eigenvalues(A, function):
    """A function of a symmetric tensor, through its eigenvalues."""
    values, axes = np.linalg.eigh(A)
    return (axes * function(values)[..., None, :]) @ np.swapaxes(axes, -1, -2)
