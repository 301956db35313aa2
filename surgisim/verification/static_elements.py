"""Equilibrium of a neo-Hookean solid in finite elements: linear tetrahedra or 27-node bricks, by Newton's method.

    psi = mu/2 (tr F^T F - 3) - mu ln J + lambda/2 (ln J)^2           [J/m^3]

In double precision and for statics only: what a published solution is checked and refined with. Bonet and Wood,
Nonlinear continuum mechanics for finite element analysis, 2nd ed. (2008), chapters 6.4.3 and 9.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from surgisim.problem import Problem

GAUSS = np.array([-np.sqrt(0.6), 0.0, np.sqrt(0.6)])
GAUSS_WEIGHT = np.array([5.0, 8.0, 5.0]) / 9
ITERATIONS = 40


@dataclass(frozen=True)
class Mesh:
    """N nodes, M elements of K nodes, Q quadrature points each."""

    points: np.ndarray
    """Nodes at rest [m], (N, 3)."""
    cells: np.ndarray
    """Node numbers, (M, K)."""
    weight: np.ndarray
    """Rest volume of each quadrature point [m^3], (M, Q)."""
    shape: np.ndarray
    """(Q, K)"""
    gradient: np.ndarray
    """Of the shape functions by rest position [1/m], (M, Q, K, 3)."""


def tetrahedra(points: np.ndarray, cells: np.ndarray) -> Mesh:
    """Linear tetrahedra, (M, 4), of either orientation."""
    edges = np.swapaxes(points[cells[:, 1:]] - points[cells[:, :1]], 1, 2)
    inverse = np.linalg.inv(edges)
    gradient = np.concatenate([-inverse.sum(1, keepdims=True), inverse], 1)
    return Mesh(points, cells, np.abs(np.linalg.det(edges))[:, None] / 6, np.full((1, 4), 0.25), gradient[:, None])


def halved(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and tetrahedra, eight for each one; the old nodes come first."""
    pairs = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
    edges, where = np.unique(np.sort(cells[:, pairs].reshape(-1, 2), 1), axis=0, return_inverse=True)
    ab, ac, ad, bc, bd, cd = where.reshape(-1, 6).T + len(points)
    a, b, c, d = cells.T
    parts = [(a, ab, ac, ad), (ab, b, bc, bd), (ac, bc, c, cd), (ad, bd, cd, d)]
    parts += [(ab, ac, ad, bd), (ab, ac, bc, bd), (ac, ad, bd, cd), (ac, bc, bd, cd)]
    return np.concatenate([points, points[edges].mean(1)]), np.concatenate([np.stack(p, 1) for p in parts])


def bricks(edges: tuple[np.ndarray, np.ndarray, np.ndarray]) -> Mesh:
    """Quadratic 27-node bricks between `edges` along each axis [m]; nodes with z fastest."""
    edges = [np.asarray(e, float) for e in edges]
    axes = [np.sort(np.concatenate([e, (e[1:] + e[:-1]) / 2])) for e in edges]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    first = np.stack(np.meshgrid(*[np.arange(0, len(a) - 2, 2) for a in axes], indexing="ij"), -1).reshape(-1, 3)
    offset = np.stack(np.meshgrid(*[np.arange(3)] * 3, indexing="ij"), -1).reshape(-1, 3)
    cells = np.ravel_multi_index(tuple((first[:, None] + offset).T), tuple(len(a) for a in axes)).T
    half = np.stack([(axes[d][first[:, d] + 2] - axes[d][first[:, d]]) / 2 for d in range(3)], -1)
    xi = GAUSS[:, None]
    value = np.hstack([xi * (xi - 1) / 2, 1 - xi**2, xi * (xi + 1) / 2])
    slope = np.hstack([xi - 0.5, -2 * xi, xi + 0.5])

    def product(*parts):
        return np.einsum("ai,bj,ck->abcijk", *parts).reshape(27, 27)

    slopes = np.stack([product(*[slope if a == d else value for a in range(3)]) for d in range(3)], -1)
    weight = np.einsum("a,b,c->abc", *[GAUSS_WEIGHT] * 3).ravel() * half.prod(1)[:, None]
    return Mesh(points, cells, weight, product(value, value, value), slopes / half[:, None, None])


def equilibrium(
    mesh: Mesh,
    mu: float,
    lam: float,
    load: tuple[float, float, float],
    held: np.ndarray,
    to: np.ndarray,
    *,
    begin: np.ndarray | None = None,
    increments: int = 1,
) -> np.ndarray:
    """Displacement at rest under `load` per rest volume [N/m^3] of nodes (N, 3) [m], where `held` (N, 3) it is `to`.

    Load and held displacement grow in equal increments, from `begin` (whose load is the whole) or from zero. Raises
    Problem where Newton's method does not converge: more increments then.
    """
    free = ~held.ravel()
    dof = (3 * mesh.cells[..., None] + np.arange(3)).reshape(len(mesh.cells), -1)
    rows, columns = np.repeat(dof, dof.shape[1], 1).ravel(), np.tile(dof, (1, dof.shape[1])).ravel()
    size = 3 * len(mesh.points)
    outside = np.zeros((len(mesh.points), 3))
    np.add.at(outside, mesh.cells, np.einsum("mq,qk,a->mka", mesh.weight, mesh.shape, np.array(load)))
    u = np.zeros_like(mesh.points) if begin is None else begin.copy()
    for share in [1.0] if begin is not None else np.arange(1, increments + 1) / increments:
        for _ in range(ITERATIONS):
            inner, element = internal_force(mesh, u, mu, lam), stiffness(mesh, u, mu, lam)
            matrix = sparse.csc_matrix((element.ravel(), (rows, columns)), (size, size))
            move = np.where(held, share * to - u, 0.0).ravel()
            lack = (share * outside - inner).ravel() - matrix @ move
            factors = splu(
                matrix[free][:, free].tocsc(),
                permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True},
            )  # fmt: skip
            move[free] = factors.solve(lack[free])
            length = 1.0
            while length > 1e-3 and _swelling(mesh, u + length * move.reshape(-1, 3)).min() <= 0:
                length /= 2
            u = u + length * move.reshape(-1, 3)
            if length == 1.0 and np.abs(move).max() <= 1e-9 * np.abs(u).max():
                break
        else:
            raise Problem(
                f"static_elements: no equilibrium after {ITERATIONS} iterations at {share:.2f} of the load. "
                "Take more increments."
            )
    return u


def internal_force(mesh: Mesh, u: np.ndarray, mu: float, lam: float) -> np.ndarray:
    """Of nodes displaced by u [m], (N, 3), as [N], (N, 3)."""
    F = deformation(mesh, u)
    turned = np.swapaxes(np.linalg.inv(F), -1, -2)
    piola = mu * (F - turned) + lam * np.log(np.linalg.det(F))[..., None, None] * turned
    force = np.zeros_like(u)
    np.add.at(force, mesh.cells, np.einsum("mqab,mqkb,mq->mka", piola, mesh.gradient, mesh.weight, optimize=True))
    return force


def stiffness(mesh: Mesh, u: np.ndarray, mu: float, lam: float) -> np.ndarray:
    """Derivative of each element's force by its nodes [N/m], (M, 3 K, 3 K)."""
    F, G, w = deformation(mesh, u), mesh.gradient, mesh.weight
    A = G @ np.linalg.inv(F)
    m, k = mesh.cells.shape
    log = np.log(np.linalg.det(F))
    flat = A.reshape(m, len(w[0]), 3 * k)
    volumetric = np.einsum("mqi,mqj,mq->mij", flat, flat, lam * w, optimize=True).reshape(m, k, 3, k, 3)
    crossed = np.einsum("mqi,mqj,mq->mij", flat, flat, (mu - lam * log) * w, optimize=True).reshape(m, k, 3, k, 3)
    straight = mu * np.einsum("mqkb,mqlb,mq->mkl", G, G, w, optimize=True)
    total = volumetric + np.swapaxes(crossed, 2, 4) + np.einsum("mkl,ac->mkalc", straight, np.eye(3))
    return total.reshape(m, 3 * k, 3 * k)


def deformation(mesh: Mesh, u: np.ndarray) -> np.ndarray:
    """F at the quadrature points, (M, Q, 3, 3)."""
    return np.eye(3) + np.einsum("mka,mqkb->mqab", u[mesh.cells], mesh.gradient, optimize=True)


def _swelling(mesh: Mesh, u: np.ndarray) -> np.ndarray:
    return np.linalg.det(deformation(mesh, u))
