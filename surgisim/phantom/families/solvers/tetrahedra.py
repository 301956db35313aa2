"""Quadratic tetrahedra with four Gauss points, a neo-Hookean solid in I1 and ln J, total Lagrangian.

    psi = mu / 2 (J^(-2/3) tr F^T F - 3) + kappa / 2 (ln J)^2                                        [J/m^3]
    P_v = 2 eta J D F^-T                                                                            [Pa]

Masses are lumped by the diagonal (Hinton, Rock and Zienkiewicz, A note on mass lumping and related processes, Earthq.
Eng. Struct. Dyn. 4, 1976). What is hidden in the tissue is written here in Green's strain E = (F^T F - 1) / 2:

    stiffening   mu exp(a (I1' - 3))                                         Demiray (1972)
    fibre        k E0 (l - 1)^2 along a, stretched by l > 1                   strands that uncrimp
    relaxation   S = 2 g mu (dev E - Q),  Q' = (dev E - Q) / tau
    plastic_set  tau = mu dev(F' G F'^T), |dev| <= 2 sqrt(2) y (1 + h a)     F' = J^(-1/3) F; a is what has flowed
    damage       mu (1 - d), d by the greatest I1' - 3 so far
    contraction  T (1 - cos)^2 / 4 along F a
    swelling     ln J counts from a volume that has grown
"""

import math

import numpy as np
from numba import njit
from scipy import sparse

from surgisim.phantom.families import stepping
from surgisim.phantom.families.hidden import Hidden
from surgisim.phantom.families.world import World
from surgisim.phantom.timeline import ease

CONCEALS = (
    "stiff_inclusion", "tether", "fibre", "stiffening", "relaxation", "plastic_set", "damage", "tool_slip",
    "hidden_contact", "respiration", "active_contraction", "sliding_base", "swelling", "second_grip", "softening",
)  # fmt: skip
OWN = ("fibre", "stiffening", "plastic_set", "damage", "softening")
MOST_E = 2.5e4
EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
A, B = 0.5854101966249685, 0.1381966011250105
"""Barycentric coordinates of the Gauss points (Hammer, Marlowe and Stroud, 1956)."""
SQRT2 = math.sqrt(2)
FAST = {"contract", "reassoc", "arcp", "nsz"}
HARDENS = 1.0
"""How much the yield strain grows with what has flowed [1]."""
LOST = 0.85
"""Most of the stiffness that damage takes [1]."""


def paths(world: World, hidden: tuple[Hidden, ...]) -> np.ndarray:
    return stepping.move(Tetrahedra(world, {h.name: h for h in hidden if h.magnitude}), world, hidden)


class Tetrahedra:
    def __init__(self, world: World, hidden: dict[str, Hidden]) -> None:
        body, law = world.body, world.material
        self.rest, self.cells, middle = quadratic(body.points, body.tets)
        self.held = np.concatenate([body.held, body.held[middle].all(1)])
        self.slope, self.weight, places = gauss(self.rest, self.cells)
        self.mass = lumped(self.weight, self.cells, len(self.rest)) * law.density
        self.law, self.world, self.hidden = law, world, hidden
        self.places = places
        count = self.weight.shape
        soft = hidden.get("stiff_inclusion")
        self.stiff = np.ones(count) if soft is None else 1 + soft.magnitude * soft.share(places)
        self.memory = np.zeros((*count, 14))
        contraction, swelling = hidden.get("active_contraction"), hidden.get("swelling")
        self.where = np.zeros(count)
        if contraction is not None:
            self.where = contraction.share(places)
        if swelling is not None:
            self.where = swelling.share(places)
        self.numbers = np.zeros(16)
        self.numbers[:3] = law.mu, law.bulk, law.eta
        for k, value in enumerate(self._numbers().values()):
            self.numbers[3 + k] = value
        along = hidden.get("fibre") or contraction
        self.along = np.array(along.numbers["direction"]) if along else np.array([1.0, 0.0, 0.0])
        self.lag = np.zeros(count)
        if contraction is not None:
            self.lag = 2 * np.pi * places @ self.along / contraction.numbers["wavelength"]
        # Probes: where their triangle's corners are in the elements' own shape functions.
        self._reader = reader(world, self.cells)

    def _numbers(self) -> dict[str, float]:
        h, law = self.hidden, self.law
        relaxation = h.get("relaxation")
        return {
            "stiffening": h["stiffening"].magnitude if "stiffening" in h else 0.0,
            "fibre": h["fibre"].magnitude * law.E if "fibre" in h else 0.0,
            "relaxation": 2 * law.mu * relaxation.magnitude if relaxation else 0.0,
            "rate": 1 / relaxation.numbers["tau"] if relaxation else 0.0,
            "yield": 1 / h["plastic_set"].magnitude if "plastic_set" in h else 0.0,
            "bears": 1 / h["damage"].magnitude if "damage" in h else 0.0,
        }

    def push(self, x, v, t, dt, keep):
        numbers, h = self.numbers.copy(), self.hidden
        if "active_contraction" in h:
            up = float(ease((t - h["active_contraction"].onset) / 0.3))
            numbers[9] = up * h["active_contraction"].magnitude * self.law.E
            numbers[10] = 2 * math.pi * (t - h["active_contraction"].onset) / h["active_contraction"].numbers["period"]
        if "swelling" in h:
            lasts = h["swelling"].numbers["lasts"]
            numbers[11] = h["swelling"].magnitude * float(ease((t - h["swelling"].onset) / lasts))
        if "softening" in h:
            lasts = h["softening"].numbers["lasts"]
            numbers[0] *= 1 - h["softening"].magnitude * float(ease((t - h["softening"].onset) / lasts))
        force = np.zeros_like(x)
        add(
            x, v, dt, keep, self.cells, self.slope, self.weight, self.stiff, self.where, self.lag, self.along, numbers,
            self.memory, force,
        )  # fmt: skip
        return force

    def tangent(self):
        law = self.law
        return (
            assembled(
                self.cells, self.slope, self.weight * self.stiff, law.mu, law.bulk - 2 * law.mu / 3, len(self.rest)
            ),
            assembled(self.cells, self.slope, self.weight, law.eta, 0.0, len(self.rest)),
        )

    def read(self, x):
        return self._reader(x - self.rest)


def quadratic(points: np.ndarray, tets: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes [m], (N, 3), with those in the middle of edges; elements, (M, 10); the ends of each added node's edge."""
    ends = np.sort(tets[:, np.array(EDGES)].reshape(-1, 2), 1)
    edges, where = np.unique(ends, axis=0, return_inverse=True)
    cells = np.concatenate([tets, len(points) + where.reshape(len(tets), 6)], 1)
    return np.concatenate([points, points[edges].mean(1)]), np.ascontiguousarray(cells), edges


def shapes(share: np.ndarray) -> np.ndarray:
    """Of the ten nodes at barycentric coordinates (..., 4), (..., 10)."""
    corner = share * (2 * share - 1)
    return np.concatenate([corner, np.stack([4 * share[..., a] * share[..., b] for a, b in EDGES], -1)], -1)


def _slopes(share: np.ndarray) -> np.ndarray:
    """d N / d share, (10, 4), at (4,)."""
    d = np.zeros((10, 4))
    for k in range(4):
        d[k, k] = 4 * share[k] - 1
    for e, (a, b) in enumerate(EDGES):
        d[4 + e, a], d[4 + e, b] = 4 * share[b], 4 * share[a]
    return d


def gauss(rest: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """d N / d X [1/m], (M, 4, 10, 3), volumes [m^3], (M, 4), and places [m], (M, 4, 3), of straight elements."""
    corners = rest[cells[:, :4]]
    jacobian = np.stack([corners[:, k] - corners[:, 3] for k in range(3)], 2)
    volume = np.abs(np.linalg.det(jacobian)) / 6
    inverse = np.linalg.inv(jacobian)
    dl = np.concatenate([inverse, -inverse.sum(1, keepdims=True)], 1)
    points = np.full((4, 4), B)
    np.fill_diagonal(points, A)
    slope = np.stack([np.einsum("al,mli->mai", _slopes(p), dl) for p in points], 1)
    return np.ascontiguousarray(slope), np.repeat(volume[:, None] / 4, 4, 1), np.einsum("gl,mli->mgi", points, corners)


def lumped(weight: np.ndarray, cells: np.ndarray, count: int) -> np.ndarray:
    """Volume at each node [m^3], (N,)."""
    # Integrals of N^2 over a straight element: corners 1/420 x 6 V, middles 32/420 x 6 V; scaled to the whole.
    share = np.array([1.0] * 4 + [32 / 6] * 6)
    result = np.zeros(count)
    np.add.at(result, cells, weight.sum(1)[:, None] * share / share.sum())
    return result


def assembled(
    cells: np.ndarray, slope: np.ndarray, weight: np.ndarray, mu: float, lam: float, count: int
) -> sparse.spmatrix:
    """Matrix of a linear isotropic solid, (3 N, 3 N)."""
    own = np.einsum("mg,mgai,mgbi->mab", weight, slope, slope)
    both = np.einsum("mg,mgai,mgbj->mabij", weight, slope, slope)
    block = lam * both + mu * both.transpose(0, 1, 2, 4, 3) + mu * own[..., None, None] * np.eye(3)
    dof = (3 * cells[..., None] + np.arange(3)).reshape(len(cells), -1)
    size = dof.shape[1]
    block = block.transpose(0, 1, 3, 2, 4).reshape(len(cells), size, size)
    rows, columns = np.repeat(dof, size, 1), np.tile(dof, (1, size))
    return sparse.coo_matrix((block.ravel(), (rows.ravel(), columns.ravel())), (3 * count, 3 * count)).tocsr()


def reader(world: World, cells: np.ndarray):
    """Displacement of the probes [m], (K, 3), from that of the nodes, (N, 3)."""
    body = world.body
    owner = {}
    for m, tet in enumerate(body.tets):
        for f in ([0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]):
            owner[tuple(sorted(tet[f]))] = m
    faces = body.upper[world.probes]
    mine = np.array([owner[tuple(sorted(f))] for f in faces])
    share = np.zeros((len(mine), 4))
    for k, (m, f) in enumerate(zip(mine, faces, strict=True)):
        for n, w in zip(f, world.weights[k], strict=True):
            share[k, np.flatnonzero(body.tets[m] == n)[0]] = w
    weight, nodes = shapes(share), cells[mine]
    return lambda shift: np.einsum("ka,kai->ki", weight, shift[nodes])


@njit(cache=True, fastmath=FAST, error_model="numpy")
def add(x, v, dt, keep, cells, slope, weight, stiff, where, lag, along, numbers, memory, force):
    """Add the elements' forces [N] to `force`; what the tissue remembers advances by dt [s] where `keep`.

    memory: Q, 6 numbers; G - 1, 6 numbers; the greatest I1' - 3; what has flowed.
    numbers: mu, kappa, eta, stiffening, fibre, relaxation,
    its rate, yield, bears, tension, its phase, growth.
    """
    F, R, C, P = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    E, S, D = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    fa = np.empty(3)
    mu0, kappa, eta = numbers[0], numbers[1], numbers[2]
    stiffening, fibre, branch, rate = numbers[3], numbers[4], numbers[5], numbers[6]
    least, bears, tension, phase, growth = numbers[7], numbers[8], numbers[9], numbers[10], numbers[11]
    for m in range(cells.shape[0]):
        for g in range(4):
            for i in range(3):
                for k in range(3):
                    F[i, k] = 0.0
                    R[i, k] = 0.0
            for a in range(10):
                n = cells[m, a]
                for i in range(3):
                    for k in range(3):
                        F[i, k] += x[n, i] * slope[m, g, a, k]
                        R[i, k] += v[n, i] * slope[m, g, a, k]
            for i in range(3):
                a1, a2 = (i + 1) % 3, (i + 2) % 3
                for k in range(3):
                    c1, c2 = (k + 1) % 3, (k + 2) % 3
                    C[i, k] = F[a1, c1] * F[a2, c2] - F[a1, c2] * F[a2, c1]
            J = F[0, 0] * C[0, 0] + F[0, 1] * C[0, 1] + F[0, 2] * C[0, 2]
            square = 0.0
            for i in range(3):
                for k in range(3):
                    square += F[i, k] * F[i, k]
            shrink = J ** (-2.0 / 3.0)
            over = shrink * square - 3.0
            mu = mu0 * stiff[m, g]
            if stiffening > 0.0:
                mu *= np.exp(stiffening * over)
            if bears > 0.0:
                most = max(over, memory[m, g, 12])
                if keep:
                    memory[m, g, 12] = most
                beyond = most - bears
                if beyond > 0.0:
                    mu *= 1.0 - LOST * (1.0 - np.exp(-beyond / (0.5 * bears + 0.02)))
            swell = np.log(J)
            if growth > 0.0:
                swell -= 3.0 * np.log(1.0 + growth * where[m, g])
            iso = kappa * stiff[m, g] * swell / J - mu * shrink * square / (3.0 * J)
            # D = sym(R F^-1), with F^-1 = C^T / J
            for i in range(3):
                for k in range(3):
                    D[i, k] = (R[i, 0] * C[k, 0] + R[i, 1] * C[k, 1] + R[i, 2] * C[k, 2]) / J
            for i in range(3):
                for k in range(3):
                    S[i, k] = eta * (D[i, k] + D[k, i])
            for i in range(3):
                for k in range(3):
                    viscous = S[i, 0] * C[0, k] + S[i, 1] * C[1, k] + S[i, 2] * C[2, k]
                    P[i, k] = mu * shrink * F[i, k] + iso * C[i, k] + viscous
            if fibre > 0.0 or tension > 0.0:
                long = 0.0
                for i in range(3):
                    fa[i] = F[i, 0] * along[0] + F[i, 1] * along[1] + F[i, 2] * along[2]
                    long += fa[i] * fa[i]
                long = np.sqrt(long)
                pull = 0.0
                if fibre > 0.0 and long > 1.0:
                    pull += fibre * (long - 1.0) ** 2
                if tension > 0.0:
                    pull += tension * where[m, g] * 0.25 * (1.0 - np.cos(phase - lag[m, g])) ** 2
                for i in range(3):
                    for k in range(3):
                        P[i, k] += pull * fa[i] * along[k] / long
            if branch > 0.0:
                mean = 0.0
                for i in range(3):
                    for k in range(3):
                        E[i, k] = 0.5 * (F[0, i] * F[0, k] + F[1, i] * F[1, k] + F[2, i] * F[2, k])
                    E[i, i] -= 0.5
                    mean += E[i, i] / 3.0
                at = 0
                for i in range(3):
                    E[i, i] -= mean
                    for k in range(i, 3):
                        lack = (E[i, k] - memory[m, g, at]) / (1.0 + dt * rate)
                        S[i, k] = branch * lack
                        S[k, i] = S[i, k]
                        if keep:
                            memory[m, g, at] = E[i, k] - lack
                        at += 1
                for i in range(3):
                    for k in range(3):
                        P[i, k] += F[i, 0] * S[0, k] + F[i, 1] * S[1, k] + F[i, 2] * S[2, k]
            if least > 0.0:
                # E: G;  S: F' G F'^T, later without what has flowed;  D: what that is short of F' F'^T.
                at = 0
                for i in range(3):
                    for k in range(i, 3):
                        E[i, k] = memory[m, g, 6 + at] + (1.0 if i == k else 0.0)
                        E[k, i] = E[i, k]
                        at += 1
                for i in range(3):
                    for k in range(3):
                        D[i, k] = F[i, 0] * E[0, k] + F[i, 1] * E[1, k] + F[i, 2] * E[2, k]
                mean = 0.0
                for i in range(3):
                    for k in range(3):
                        S[i, k] = shrink * (D[i, 0] * F[k, 0] + D[i, 1] * F[k, 1] + D[i, 2] * F[k, 2])
                    mean += S[i, i] / 3.0
                size = 0.0
                for i in range(3):
                    S[i, i] -= mean
                    for k in range(3):
                        size += S[i, k] * S[i, k]
                size = np.sqrt(size)
                limit = 2.0 * SQRT2 * least * (1.0 + HARDENS * memory[m, g, 13])
                if size > limit:
                    for i in range(3):
                        for k in range(3):
                            S[i, k] *= limit / size
                if keep and size > limit:
                    memory[m, g, 13] += (size - limit) / (2.0 * SQRT2)
                    # G = F'^-1 b F'^-T, with F^-1 = C^T / J
                    for i in range(3):
                        S[i, i] += mean
                    for i in range(3):
                        for k in range(3):
                            D[i, k] = S[i, 0] * C[0, k] + S[i, 1] * C[1, k] + S[i, 2] * C[2, k]
                    at = 0
                    for i in range(3):
                        for k in range(i, 3):
                            whole = C[0, i] * D[0, k] + C[1, i] * D[1, k] + C[2, i] * D[2, k]
                            memory[m, g, 6 + at] = whole / (shrink * J * J) - (1.0 if i == k else 0.0)
                            at += 1
                    for i in range(3):
                        S[i, i] -= mean
                for i in range(3):
                    for k in range(3):
                        P[i, k] += mu * (S[i, 0] * C[0, k] + S[i, 1] * C[1, k] + S[i, 2] * C[2, k]) / J
                        P[i, k] -= mu * (shrink * F[i, k] - shrink * square / (3.0 * J) * C[i, k])
            w = weight[m, g]
            for a in range(10):
                n = cells[m, a]
                for i in range(3):
                    force[n, i] -= w * (
                        P[i, 0] * slope[m, g, a, 0] + P[i, 1] * slope[m, g, a, 1] + P[i, 2] * slope[m, g, a, 2]
                    )
