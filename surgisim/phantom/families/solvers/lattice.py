"""Quadratic B-splines on a lattice that the body is cut out of, in logarithmic strain, held by stiff springs.

    F = R U,  e = log U = sum_i ln l_i n_i n_i,   T = 2 mu dev e + kappa tr e,   P = F U^-1 T U^-1      Hencky (1928)

Exact where T and e have the same axes; what is remembered along others is so to second order in strain. The tissue is
sampled at the middles of small tetrahedra, each with its volume; the lattice knows nothing of the body's sides, and its
nodes that hardly lie in the body go on as those inside do, linearly. What holds the body are points of its own, tied to
the lattice by springs. What is hidden in the tissue is written in e:

    stiffening   mu (1 + 3 a |dev e|^2)
    fibre        k E0 (l - 1)^(3/2) along a, stretched by l > 1
    relaxation   T += 2 g mu (dev e - q),  q' = (dev e - q) / tau
    plastic_set  T -= 2 mu p,  p' = (1 - y / |dev e - p|) (dev e - p) / t0 beyond y                 Perzyna (1966)
    damage       mu / (1 + d), d by the greatest |dev e|^2 so far
    contraction  T sin^4 along F a
    swelling     tr e counts from a volume that has grown
"""

import math

import numpy as np
from numba import njit
from scipy import sparse
from scipy.spatial import cKDTree

from surgisim.phantom.families import stepping
from surgisim.phantom.families.hidden import Hidden
from surgisim.phantom.families.solvers.springs import EIGHT
from surgisim.phantom.families.solvers.tetrahedra import quadratic
from surgisim.phantom.families.world import World
from surgisim.phantom.timeline import ease

CONCEALS = (
    "stiff_inclusion", "tether", "fibre", "stiffening", "relaxation", "plastic_set", "damage", "tool_slip",
    "hidden_contact", "respiration", "active_contraction", "sliding_base", "swelling", "second_grip", "softening",
)  # fmt: skip
OWN = ("fibre", "stiffening", "plastic_set", "damage", "softening")
MOST_E = 4e4
CELLS = 3.0
"""Cells through the thickness of a body, within FINEST and COARSEST [m]."""
FINEST, COARSEST = 2.8e-3, 5.0e-3
EMPTY = 0.06
"""Share of a cell's volume below which a node follows others."""
FOLLOWED = 14
"""How many it follows."""
TIED = 2e-4
"""Held points are tied by springs as stiff as tissue of this thickness [m]."""
FLOWS = 0.15
"""How fast what is beyond the yield strain flows [s]."""
FAST = {"contract", "reassoc", "arcp", "nsz"}


def paths(world: World, hidden: tuple[Hidden, ...]) -> np.ndarray:
    return stepping.move(Lattice(world, {h.name: h for h in hidden if h.magnitude}), world, hidden)


class Lattice:
    def __init__(self, world: World, hidden: dict[str, Hidden]) -> None:
        body, law = world.body, world.material
        nodes, cells, _ = quadratic(body.points, body.tets)
        small = cells[:, EIGHT].reshape(-1, 4)
        a, b, c, d = np.moveaxis(nodes[small], 1, 0)
        self.volume = np.abs(np.einsum("mi,mi->m", np.cross(b - a, c - a), d - a)) / 6
        self.places = nodes[small].mean(1)
        spacing = float(np.clip(body.thickness / CELLS, FINEST, COARSEST))
        grid = Splines(body.points, spacing)
        index, weight, slope = grid.at(self.places)
        base = np.flatnonzero(body.held)
        own, tie, _ = grid.at(body.points[base])
        probe, share, _ = grid.at(world.rest)
        mass = np.bincount(index.ravel(), (self.volume[:, None] * weight).ravel(), grid.count) * law.density
        kept = np.flatnonzero(mass > EMPTY * spacing**3 * law.density)
        used = np.unique(np.concatenate([index.ravel(), own.ravel(), probe.ravel()]))
        follow = _following(grid.places, kept, used)
        number = np.full(grid.count, -1)
        number[used] = np.arange(len(used))
        self.index, self.slope = number[index], slope
        self.probe, self.share = number[probe], share
        self.rest = np.concatenate([grid.places[kept], body.points[base]])
        count, first = len(used), len(kept)
        self.follow = sparse.hstack([follow, sparse.csr_matrix((count, len(base)))]).tocsr()
        area = _area(world)
        inner = follow.T @ mass[used]
        self.mass = np.concatenate([np.maximum(inner, 0.02 * inner.max()), np.full(len(base), 1e-3 * mass.max())])
        self.held = np.concatenate([np.zeros(first, bool), np.ones(len(base), bool)])
        rows = np.repeat(np.arange(len(base)), own.shape[1])
        onto = sparse.csr_matrix((tie.ravel(), (rows, number[own].ravel())), (len(base), count)) @ follow
        self.tie = sparse.hstack([onto, -sparse.eye(len(base))]).tocsr()
        self.firm = law.E * area / len(base) / TIED
        self.law, self.hidden, count = law, hidden, len(self.places)
        soft, contraction, swelling = (hidden.get(n) for n in ("stiff_inclusion", "active_contraction", "swelling"))
        self.stiff = np.ones(count) if soft is None else 1 + soft.magnitude * soft.share(self.places)
        acts = contraction or swelling
        self.where = acts.share(self.places) if acts else np.zeros(count)
        directed = hidden.get("fibre") or contraction
        self.along = np.array(directed.numbers["direction"]) if directed else np.array([1.0, 0.0, 0.0])
        self.lag = np.zeros(count)
        if contraction is not None:
            self.lag = np.pi * self.places @ self.along / contraction.numbers["wavelength"]
        self.memory = np.zeros((count, 13))

    def push(self, x, v, t, dt, keep):
        h, law = self.hidden, self.law
        numbers = np.zeros(12)
        numbers[:3] = law.mu, law.bulk, law.eta
        for k, name in ((3, "stiffening"), (4, "fibre"), (5, "relaxation")):
            numbers[k] = h[name].magnitude if name in h else 0.0
        numbers[4] *= law.E
        numbers[6] = 1 / h["relaxation"].numbers["tau"] if "relaxation" in h else 0.0
        numbers[7] = 1 / h["plastic_set"].magnitude if "plastic_set" in h else 0.0
        numbers[8] = 1 / h["damage"].magnitude if "damage" in h else 0.0
        if "active_contraction" in h:
            since = t - h["active_contraction"].onset
            numbers[9] = float(ease(since / 0.3)) * h["active_contraction"].magnitude * law.E
            numbers[10] = math.pi * since / h["active_contraction"].numbers["period"]
        if "swelling" in h:
            up = float(ease((t - h["swelling"].onset) / h["swelling"].numbers["lasts"]))
            numbers[11] = h["swelling"].magnitude * up
        if "softening" in h:
            up = float(ease((t - h["softening"].onset) / h["softening"].numbers["lasts"]))
            numbers[0] *= 1 - h["softening"].magnitude * up
        moved, speed = self.follow @ (x - self.rest), self.follow @ v
        inside = np.zeros_like(moved)
        add(
            moved, speed, dt, keep, self.index, self.slope, self.volume, self.stiff, self.where, self.lag,
            self.along, numbers, self.memory, inside,
        )  # fmt: skip
        return self.follow.T @ inside - self.firm * (self.tie.T @ (self.tie @ (x - self.rest)))

    def tangent(self):
        law, count = self.law, self.follow.shape[0]
        follow = sparse.kron(self.follow, sparse.eye(3)).tocsr()
        tied = sparse.kron(self.firm * (self.tie.T @ self.tie), sparse.eye(3))
        volume = self.volume * self.stiff
        stiff = _assembled(self.index, self.slope, volume, law.mu, law.bulk - 2 * law.mu / 3, count)
        damping = _assembled(self.index, self.slope, self.volume, law.eta, 0.0, count)
        return (follow.T @ stiff @ follow + tied).tocsr(), (follow.T @ damping @ follow).tocsr()

    def read(self, x):
        return np.einsum("ka,kai->ki", self.share, (self.follow @ (x - self.rest))[self.probe])


class Splines:
    """Quadratic B-splines on a lattice around points."""

    def __init__(self, points: np.ndarray, spacing: float) -> None:
        self.low, self.spacing = points.min(0) - 1.63 * spacing, spacing
        self.shape = np.ceil((np.ptp(points, axis=0) + 3.3 * spacing) / spacing).astype(int) + 1
        self.count = int(np.prod(self.shape))
        self.places = self.low + spacing * np.stack(np.unravel_index(np.arange(self.count), self.shape), -1)

    def at(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Nodes (Q, 27), their weights, and the slopes of these [1/m], (Q, 27, 3), at places [m], (Q, 3)."""
        s = (places - self.low) / self.spacing
        first = np.floor(s - 0.5).astype(int)
        off = (s - first)[..., None] - np.arange(3)
        one = np.where(np.abs(off) < 0.5, 0.75 - off**2, 0.5 * (1.5 - np.abs(off)) ** 2)
        slope = np.where(np.abs(off) < 0.5, -2 * off, -np.sign(off) * (1.5 - np.abs(off))) / self.spacing
        i, j, k = (a.ravel() for a in np.meshgrid(*[np.arange(3)] * 3, indexing="ij"))
        index = np.ravel_multi_index(
            [first[:, 0, None] + i, first[:, 1, None] + j, first[:, 2, None] + k], tuple(self.shape)
        )
        x, y, z = one[:, 0][:, i], one[:, 1][:, j], one[:, 2][:, k]
        dx, dy, dz = slope[:, 0][:, i], slope[:, 1][:, j], slope[:, 2][:, k]
        return index, x * y * z, np.ascontiguousarray(np.stack([dx * y * z, x * dy * z, x * y * dz], -1))


def _following(places: np.ndarray, kept: np.ndarray, used: np.ndarray) -> sparse.spmatrix:
    """What each used node takes of the kept ones, (U, K): itself, or what goes on linearly from the nearest."""
    near = cKDTree(places[kept]).query(places[used], FOLLOWED)[1]
    inside = np.isin(used, kept)
    rows, columns, values = [], [], []
    for u, (node, mine) in enumerate(zip(used, near, strict=True)):
        if inside[u]:
            some, share = mine[:1], np.ones(1)
        else:
            off = places[kept[mine]] - places[node]
            scale = np.abs(off).max()
            some, share = mine, np.linalg.pinv(np.column_stack([np.ones(len(mine)), off / scale]))[0]
        rows += [u] * len(some)
        columns += some.tolist()
        values += share.tolist()
    return sparse.csr_matrix((values, (rows, columns)), (len(used), len(kept)))


def _area(world: World) -> float:
    """Of what is held [m^2]."""
    body = world.body
    a, b, c = np.moveaxis(body.points[body.skin[body.held[body.skin].all(1)]], 1, 0)
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def _assembled(index, slope, weight, mu: float, lam: float, size: int) -> sparse.spmatrix:
    """Matrix of a linear isotropic solid, (3 N, 3 N), from sparse differences: no block of every sample is made."""
    rows = np.repeat(np.arange(len(index)), index.shape[1])
    D = [sparse.csr_matrix((slope[..., i].ravel(), (rows, index.ravel())), (len(index), size)) for i in range(3)]
    W = sparse.diags(weight)
    pairs = [[(D[i].T @ W @ D[j]).tocsr() for j in range(3)] for i in range(3)]
    own = pairs[0][0] + pairs[1][1] + pairs[2][2]
    blocks = [
        [lam * pairs[i][j] + mu * pairs[j][i] + (mu * own if i == j else 0 * own) for j in range(3)] for i in range(3)
    ]
    order = np.arange(3 * size).reshape(3, size).T.ravel()
    return sparse.bmat(blocks).tocsr()[order][:, order]


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _axes(C, V):
    """Eigenvectors of a symmetric matrix into V, by Jacobi's turns; its diagonal becomes the eigenvalues."""
    for i in range(3):
        for k in range(3):
            V[i, k] = 1.0 if i == k else 0.0
    for _ in range(8):
        rest = abs(C[0, 1]) + abs(C[0, 2]) + abs(C[1, 2])
        if rest < 1e-14 * (C[0, 0] + C[1, 1] + C[2, 2]):
            break
        for p in range(2):
            for q in range(p + 1, 3):
                if C[p, q] == 0.0:
                    continue
                theta = 0.5 * (C[q, q] - C[p, p]) / C[p, q]
                t = 1.0 / (abs(theta) + np.sqrt(theta * theta + 1.0))
                if theta < 0.0:
                    t = -t
                c = 1.0 / np.sqrt(t * t + 1.0)
                s = t * c
                for k in range(3):
                    a, b = C[k, p], C[k, q]
                    C[k, p], C[k, q] = c * a - s * b, s * a + c * b
                for k in range(3):
                    a, b = C[p, k], C[q, k]
                    C[p, k], C[q, k] = c * a - s * b, s * a + c * b
                for k in range(3):
                    a, b = V[k, p], V[k, q]
                    V[k, p], V[k, q] = c * a - s * b, s * a + c * b


@njit(cache=True, fastmath=FAST, error_model="numpy")
def add(u, v, dt, keep, index, slope, volume, stiff, where, lag, along, numbers, memory, force):
    """Add the samples' forces [N] to `force`, at displacements u [m]; what the tissue remembers goes on where `keep`.

    memory: q, 6 numbers; p, 6 numbers; the greatest |dev e|^2. numbers: mu, kappa, eta, stiffening, fibre, relaxation,
    its rate, yield, bears, tension, its phase, growth.
    """
    F, R, C, V = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    e, T, P, D = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    inverse, fa = np.empty((3, 3)), np.empty(3)
    kappa, eta = numbers[1], numbers[2]
    least, bears, tension = numbers[7], numbers[8], numbers[9]
    for m in range(len(index)):
        for i in range(3):
            for k in range(3):
                F[i, k] = 1.0 if i == k else 0.0
                R[i, k] = 0.0
        for a in range(27):
            n = index[m, a]
            for i in range(3):
                for k in range(3):
                    F[i, k] += u[n, i] * slope[m, a, k]
                    R[i, k] += v[n, i] * slope[m, a, k]
        for i in range(3):
            for k in range(3):
                C[i, k] = F[0, i] * F[0, k] + F[1, i] * F[1, k] + F[2, i] * F[2, k]
        _axes(C, V)
        J = (
            F[0, 0] * (F[1, 1] * F[2, 2] - F[1, 2] * F[2, 1])
            - F[0, 1] * (F[1, 0] * F[2, 2] - F[1, 2] * F[2, 0])
            + F[0, 2] * (F[1, 0] * F[2, 1] - F[1, 1] * F[2, 0])
        )
        if J <= 0.0:
            force[0, 0] = np.nan
            return
        trace = np.log(J)
        square = 0.0
        for i in range(3):
            for k in range(3):
                e[i, k] = 0.0
                inverse[i, k] = 0.0
                for j in range(3):
                    e[i, k] += (0.5 * np.log(C[j, j]) - trace / 3.0) * V[i, j] * V[k, j]
                    inverse[i, k] += V[i, j] * V[k, j] / np.sqrt(C[j, j])
                square += e[i, k] * e[i, k]
        mu = numbers[0] * stiff[m] * (1.0 + 3.0 * numbers[3] * square)
        if bears > 0.0:
            most = max(square, memory[m, 12])
            if keep:
                memory[m, 12] = most
            if most > bears:
                mu /= 1.0 + (most - bears) / bears
        pressure = kappa * stiff[m] * (trace - 3.0 * np.log(1.0 + numbers[11] * where[m]))
        over = 0.0
        if least > 0.0:
            at = 0
            for i in range(3):
                for k in range(i, 3):
                    over += (e[i, k] - memory[m, 6 + at]) ** 2 * (1.0 if i == k else 2.0)
                    at += 1
            over = np.sqrt(over)
        flow = (1.0 - least / over) * dt / (dt + FLOWS) if least > 0.0 and over > least else 0.0
        at = 0
        for i in range(3):
            for k in range(i, 3):
                T[i, k] = 2.0 * mu * e[i, k] + (pressure if i == k else 0.0)
                if numbers[5] > 0.0:
                    lack = (e[i, k] - memory[m, at]) / (1.0 + dt * numbers[6])
                    T[i, k] += 2.0 * numbers[5] * numbers[0] * lack
                    if keep:
                        memory[m, at] = e[i, k] - lack
                if least > 0.0:
                    gone = memory[m, 6 + at] + flow * (e[i, k] - memory[m, 6 + at])
                    T[i, k] -= 2.0 * mu * gone
                    if keep:
                        memory[m, 6 + at] = gone
                T[k, i] = T[i, k]
                at += 1
        # C: T U^-1;  T: U^-1 T U^-1, the second Piola-Kirchhoff stress.
        for i in range(3):
            for k in range(3):
                C[i, k] = T[i, 0] * inverse[0, k] + T[i, 1] * inverse[1, k] + T[i, 2] * inverse[2, k]
        for i in range(3):
            for k in range(3):
                T[i, k] = inverse[i, 0] * C[0, k] + inverse[i, 1] * C[1, k] + inverse[i, 2] * C[2, k]
        for i in range(3):
            for k in range(3):
                P[i, k] = F[i, 0] * T[0, k] + F[i, 1] * T[1, k] + F[i, 2] * T[2, k]
        # C: J F^-T; viscous stress 2 eta D.
        for i in range(3):
            a1, a2 = (i + 1) % 3, (i + 2) % 3
            for k in range(3):
                c1, c2 = (k + 1) % 3, (k + 2) % 3
                C[i, k] = F[a1, c1] * F[a2, c2] - F[a1, c2] * F[a2, c1]
        for i in range(3):
            for k in range(3):
                D[i, k] = (R[i, 0] * C[k, 0] + R[i, 1] * C[k, 1] + R[i, 2] * C[k, 2]) / J
        for i in range(3):
            for k in range(3):
                for j in range(3):
                    P[i, k] += eta * (D[i, j] + D[j, i]) * C[j, k]
        if numbers[4] > 0.0 or tension > 0.0:
            long = 0.0
            for i in range(3):
                fa[i] = F[i, 0] * along[0] + F[i, 1] * along[1] + F[i, 2] * along[2]
                long += fa[i] * fa[i]
            long = np.sqrt(long)
            pull = tension * where[m] * np.sin(numbers[10] - lag[m]) ** 4
            if numbers[4] > 0.0 and long > 1.0:
                pull += numbers[4] * (long - 1.0) ** 1.5
            for i in range(3):
                for k in range(3):
                    P[i, k] += pull * fa[i] * along[k] / long
        w = volume[m]
        for a in range(27):
            n = index[m, a]
            for i in range(3):
                force[n, i] -= w * (P[i, 0] * slope[m, a, 0] + P[i, 1] * slope[m, a, 1] + P[i, 2] * slope[m, a, 2])
