"""Extra stresses in elements: one mean gradient each, in plain compiled loops.

The mean gradient of an element integrates any stress that is constant in it exactly (Flanagan and Belytschko, A
uniform strain hexahedron, IJNME 17, 1981); the base law keeps the other modes stiff.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from surgisim.phantom.elements import SLOPES
from surgisim.phantom.forces import FAST

EDGE = 0.3
"""Half the width of a blob's edge over its radius."""


@dataclass(frozen=True)
class Patch:
    """The elements in which an extra stress acts."""

    cells: np.ndarray
    """Node numbers, (M, 8)."""
    slope: np.ndarray
    """Mean gradients of the shape functions at rest [1/m], (M, 8, 3)."""
    volume: np.ndarray
    """At rest, times the share to which the stress acts [m^3], (M,)."""
    number: np.ndarray
    """Of each element in its mesh, (M,)."""

    @property
    def args(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.cells, self.slope, self.volume


def patch(points: np.ndarray, cells: np.ndarray, share: np.ndarray | None = None) -> Patch:
    """Of the elements whose `share`, (M,), is not zero; all by default."""
    share = np.ones(len(cells)) if share is None else share
    number = np.flatnonzero(share > 1e-3)
    cells = cells[number]
    jacobian = np.einsum("mai,gak->mgik", points[cells], SLOPES)
    weight = np.linalg.det(jacobian)
    slope = np.einsum("gak,mgkj,mg->maj", SLOPES, np.linalg.inv(jacobian), weight) / weight.sum(1)[:, None, None]
    return Patch(np.ascontiguousarray(cells), np.ascontiguousarray(slope), weight.sum(1) * share[number], number)


def blob(points: np.ndarray, center: np.ndarray, radius: float) -> np.ndarray:
    """1 inside a ball, 0 outside, 1/2 at its `radius` [m], smooth between, (...)."""
    away = np.linalg.norm(points - center, axis=-1) / radius
    s = np.clip((away - 1 + EDGE) / (2 * EDGE), 0, 1)
    return 1 - s * s * (3 - 2 * s)


@njit(cache=True, fastmath=FAST, error_model="numpy")
def gradient(field, cells, slope, m, out):
    """Mean gradient of a nodal field in element m, into (3, 3)."""
    out[:] = 0.0
    for a in range(8):
        n = cells[m, a]
        for i in range(3):
            for k in range(3):
                out[i, k] += field[n, i] * slope[m, a, k]


@njit(cache=True, fastmath=FAST, error_model="numpy")
def scatter(P, cells, slope, volume, m, force):
    """Nodal forces of a first Piola-Kirchhoff stress (3, 3) in element m, into `force`."""
    for a in range(8):
        n = cells[m, a]
        for i in range(3):
            force[n, i] -= volume[m] * (P[i, 0] * slope[m, a, 0] + P[i, 1] * slope[m, a, 1] + P[i, 2] * slope[m, a, 2])


@njit(cache=True, fastmath=FAST, error_model="numpy")
def cofactor(F, out):
    """J F^-T into (3, 3); returns J."""
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        for k in range(3):
            c, d = (k + 1) % 3, (k + 2) % 3
            out[i, k] = F[a, c] * F[b, d] - F[a, d] * F[b, c]
    return F[0, 0] * out[0, 0] + F[0, 1] * out[0, 1] + F[0, 2] * out[0, 2]


@njit(cache=True, fastmath=FAST, error_model="numpy")
def square(F):
    """tr F^T F."""
    total = 0.0
    for i in range(3):
        for k in range(3):
            total += F[i, k] * F[i, k]
    return total
