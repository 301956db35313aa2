"""8-node hexahedra at rest: their gradients, volumes, masses and laws, laid out for the force kernel."""

from dataclasses import dataclass

import numpy as np

from surgisim.phantom.law import Law
from surgisim.problem import Problem

LANES = 8
"""Elements side by side."""
CORNERS = np.array([[(a & 1), (a >> 1 & 1), (a >> 2 & 1)] for a in range(8)]) * 2.0 - 1.0
"""xi, eta, zeta of the eight nodes, the first fastest, (8, 3)."""
GAUSS = CORNERS / np.sqrt(3)
"""The same of the eight Gauss points, (8, 3)."""
SLOPES = np.stack([CORNERS * np.roll(1 + g * CORNERS, 1, 1) * np.roll(1 + g * CORNERS, 2, 1) for g in GAUSS]) / 8
"""d N_a / d xi_k at the Gauss points, (8, 8, 3)."""


@dataclass(frozen=True)
class Elements:
    """Elements in blocks of LANES; the last block is filled up with elements of no weight."""

    cells: np.ndarray
    """Node numbers, (B, 8, LANES)."""
    inverse: np.ndarray
    """d xi_k / d X_j at each Gauss point [1/m], (B, 8, 9, LANES)."""
    weight: np.ndarray
    """Rest volume of each Gauss point [m^3], (B, 8, LANES)."""
    mu: np.ndarray
    """[Pa], (B, LANES)."""
    lam: np.ndarray
    """[Pa], (B, LANES)."""
    eta: np.ndarray
    """[Pa s], (B, LANES)."""
    mass: np.ndarray
    """Lumped at the nodes [kg], (N,)."""


def elements(points: np.ndarray, cells: np.ndarray, law: Law) -> Elements:
    """Blocks for nodes at rest `points` [m], (N, 3), and `cells`, (M, 8) in the order of CORNERS."""
    jacobian = np.einsum("mai,gak->mgik", points[cells], SLOPES)
    volume = np.linalg.det(jacobian)
    if volume.min() <= 0:
        raise Problem(f"phantom: element {int(volume.min(1).argmin())} of the mesh is inside out. Use a finer spacing.")
    inverse = np.linalg.inv(jacobian).reshape(len(cells), 8, 9)
    shape = np.prod(1 + GAUSS[:, None] * CORNERS, axis=2) / 8
    mass = np.zeros(len(points))
    np.add.at(mass, cells, law.density * volume @ shape)
    padded = _blocks(volume)
    padded[-1, :, (len(cells) - 1) % LANES + 1 :] = 0.0
    mu, lam, eta = (_blocks(np.full(len(cells), value)) for value in (law.mu, law.lam, law.eta))
    return Elements(_blocks(cells), _blocks(inverse), padded, mu, lam, eta, mass)


def _blocks(values: np.ndarray) -> np.ndarray:
    """(M, ...) to (B, ..., LANES), repeating element 0 at the end."""
    rows = np.concatenate([values, np.repeat(values[:1], -len(values) % LANES, 0)])
    return np.ascontiguousarray(np.moveaxis(rows.reshape(-1, LANES, *values.shape[1:]), 1, -1))
