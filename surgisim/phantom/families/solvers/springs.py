"""Points joined by springs, and small tetrahedra that keep their volume: not a continuum, and so a little wrong.

    f = k (L - L0) along each spring                                                                  [N]
    p = b (V / V0 - 1) in each tetrahedron                                                          [Pa]

A point is joined to those about it, and the springs' constants k >= 0 are those by which its surroundings come nearest
to a solid that is alike in all directions: sum k L0^2 (n n n n) = mu V (dd + dd + dd), n their directions (Cauchy's
relation: lambda = mu). Edges of a mesh alone have shear moduli that differ threefold between directions; these differ
by some per cent, in a tube by up to a third. The volumes raise Poisson's ratio. What is hidden in the tissue is written
for springs: they stiffen with the square of their strain, creep, take a set, tear in part, shorten, and are more along
some direction than along others.
"""

import math

import numpy as np
from numba import njit
from scipy import sparse
from scipy.spatial import cKDTree

from surgisim.phantom.families import stepping
from surgisim.phantom.families.hidden import Hidden
from surgisim.phantom.families.solvers.tetrahedra import quadratic, reader
from surgisim.phantom.families.world import World
from surgisim.phantom.timeline import ease

CONCEALS = (
    "stiff_inclusion", "tether", "fibre", "stiffening", "relaxation", "plastic_set", "damage", "tool_slip",
    "hidden_contact", "respiration", "active_contraction", "sliding_base", "swelling", "second_grip", "softening",
)  # fmt: skip
OWN = (
    "stiff_inclusion",
    "fibre",
    "stiffening",
    "relaxation",
    "plastic_set",
    "damage",
    "active_contraction",
    "softening",
)
"""What a number means for springs and for no continuum."""
MOST_E = 6e4
EIGHT = np.array(
    [[0, 4, 6, 7], [4, 1, 5, 8], [6, 5, 2, 9], [7, 8, 9, 3], [4, 5, 6, 7], [4, 8, 5, 7], [5, 9, 6, 7], [5, 8, 9, 7]]
)
"""A tetrahedron of ten nodes as eight of four."""
JOINED, JOINED_IN_TUBES = 24, 44
"""Points that one is joined to, about. A tube's cells are longer than its wall is thick: there fewer are not enough."""
DIRECTIONS, ROUNDS, PACE = 45, 220, 1.7
"""In which springs are made alike, how often they are corrected, and the power to which each correction is taken."""
TORN = 0.8
"""Most of its stiffness that a spring loses [1]."""


def paths(world: World, hidden: tuple[Hidden, ...]) -> np.ndarray:
    return stepping.move(Springs(world, {h.name: h for h in hidden if h.magnitude}), world, hidden)


class Springs:
    def __init__(self, world: World, hidden: dict[str, Hidden]) -> None:
        body, law = world.body, world.material
        self.rest, cells, middle = quadratic(body.points, body.tets)
        self.held = np.concatenate([body.held, body.held[middle].all(1)])
        tets = cells[:, EIGHT].reshape(-1, 4)
        a, b, c, d = np.moveaxis(self.rest[tets], 1, 0)
        volume = np.einsum("mi,mi->m", np.cross(b - a, c - a), d - a) / 6
        tets[volume < 0] = tets[volume < 0][:, [0, 1, 3, 2]]
        self.tets, self.volume = np.ascontiguousarray(tets), np.abs(volume)
        around = np.bincount(tets.ravel(), np.repeat(self.volume, 4) / 4, len(self.rest))
        self.mass = around * law.density
        ends = joined(self.rest, tets, JOINED_IN_TUBES if body.kind == "tube" else JOINED)
        self.ends = np.ascontiguousarray(ends)
        way = self.rest[ends[:, 1]] - self.rest[ends[:, 0]]
        self.length = np.linalg.norm(way, axis=1)
        self.k = law.mu * alike(way / self.length[:, None], ends, around) / self.length**2
        self.bulk = max(law.bulk - 5 * law.mu / 3, 0.0)
        self.lag = law.eta / law.E
        self.law, self.hidden, self.way = law, hidden, way
        middle_of = self.rest[ends].mean(1)
        soft = hidden.get("stiff_inclusion")
        if soft is not None:
            self.k *= 1 + soft.magnitude * soft.share(middle_of)
        directed = hidden.get("fibre") or hidden.get("active_contraction")
        along = np.array(directed.numbers["direction"]) if directed else np.array([1.0, 0.0, 0.0])
        aligned = (way @ along / self.length) ** 2
        self.fibre = hidden["fibre"].magnitude * 0.2 * self.k * aligned**2 if "fibre" in hidden else 0 * self.k
        self.aligned, self.where, self.phase = aligned, np.ones(len(ends)), 0 * self.k
        contraction, swelling = hidden.get("active_contraction"), hidden.get("swelling")
        if contraction is not None:
            self.where = contraction.share(middle_of)
            self.phase = 2 * np.pi * middle_of @ along / contraction.numbers["wavelength"]
        if swelling is not None:
            self.where = swelling.share(middle_of)
        self.creep, self.set, self.most = self.length.copy(), 0 * self.length, 0 * self.length
        self._reader = reader(world, cells)

    def push(self, x, v, t, dt, keep):
        h, force = self.hidden, np.zeros_like(x)
        rest, k = self.length, self.k
        if "active_contraction" in h:
            up = h["active_contraction"].magnitude * float(ease((t - h["active_contraction"].onset) / 0.3))
            turn = 2 * math.pi * (t - h["active_contraction"].onset) / h["active_contraction"].numbers["period"]
            rest = rest * (1 - up * self.where * self.aligned * 0.25 * (1 - np.cos(turn - self.phase)) ** 2)
        if "swelling" in h:
            up = float(ease((t - h["swelling"].onset) / h["swelling"].numbers["lasts"]))
            rest = rest * (1 + h["swelling"].magnitude * up * self.where)
        if "softening" in h:
            up = float(ease((t - h["softening"].onset) / h["softening"].numbers["lasts"]))
            k = k * (1 - h["softening"].magnitude * up)
        relaxation = h.get("relaxation")
        pull(
            x, v, dt, keep, self.ends, self.length, rest, k, self.k, self.fibre, self.lag,
            h["stiffening"].magnitude if "stiffening" in h else 0.0,
            relaxation.magnitude if relaxation else 0.0, relaxation.numbers["tau"] if relaxation else 1.0,
            0.8 / h["plastic_set"].magnitude if "plastic_set" in h else 0.0,
            0.5 / h["damage"].magnitude if "damage" in h else 0.0,
            self.creep, self.set, self.most, force,
        )  # fmt: skip
        swell(x, self.tets, self.volume, self.bulk, force)
        return force

    def tangent(self):
        n = self.way / self.length[:, None]
        block = (self.k + self.fibre)[:, None, None] * n[:, :, None] * n[:, None, :]
        stiff = self._of_springs(block)
        damping = self._of_springs(self.lag * self.k[:, None, None] * n[:, :, None] * n[:, None, :])
        a, b, c, d = np.moveaxis(self.rest[self.tets], 1, 0)
        slope = np.stack(
            [np.cross(d - b, c - b), np.cross(c - a, d - a), np.cross(d - a, b - a), np.cross(b - a, c - a)], 1
        ) / (6 * self.volume[:, None, None])
        slope = slope.reshape(-1, 12)
        both = (self.bulk * self.volume)[:, None, None] * slope[:, :, None] * slope[:, None, :]
        dof = (3 * self.tets[..., None] + np.arange(3)).reshape(-1, 12)
        size = 3 * len(self.rest)
        rows, columns = np.repeat(dof, 12, 1), np.tile(dof, (1, 12))
        return stiff + sparse.coo_matrix((both.ravel(), (rows.ravel(), columns.ravel())), (size, size)).tocsr(), damping

    def _of_springs(self, block: np.ndarray) -> sparse.spmatrix:
        dof = 3 * self.ends[..., None] + np.arange(3)
        size, parts = 3 * len(self.rest), []
        for p in range(2):
            for q in range(2):
                rows = np.repeat(dof[:, p], 3, 1)
                columns = np.tile(dof[:, q], (1, 3))
                values = block.reshape(len(block), 9) * (1 if p == q else -1)
                parts.append(sparse.coo_matrix((values.ravel(), (rows.ravel(), columns.ravel())), (size, size)))
        return sum(parts).tocsr()

    def read(self, x):
        return self._reader(x - self.rest)


def joined(rest: np.ndarray, tets: np.ndarray, count: int) -> np.ndarray:
    """Pairs of points, (S, 2), nearest by their own surroundings' measure, so that a point has `count` of them about.

    Where a mesh is finer along one direction than along others, as near is what is as many cells away.
    """
    corner = np.array([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)])
    edges = np.unique(np.sort(tets[:, corner].reshape(-1, 2), 1), axis=0)
    way = rest[edges[:, 1]] - rest[edges[:, 0]]
    spread, edges_of = np.zeros((len(rest), 3, 3)), np.bincount(edges.ravel(), minlength=len(rest))
    for end in (0, 1):
        np.add.at(spread, edges[:, end], way[:, :, None] * way[:, None, :])
    measure = np.linalg.inv(spread / edges_of[:, None, None])
    pairs = cKDTree(rest).query_pairs(2.2 * np.linalg.norm(way, axis=1).max(), output_type="ndarray")
    apart = rest[pairs[:, 1]] - rest[pairs[:, 0]]
    away = np.einsum("si,sij,sj->s", apart, measure[pairs[:, 0]] + measure[pairs[:, 1]], apart)
    return pairs[np.argsort(away, kind="stable")[: len(rest) * count // 2]]


def alike(way: np.ndarray, ends: np.ndarray, around: np.ndarray) -> np.ndarray:
    """k L0^2 over the shear modulus of each spring [m^3], (S,), by which points' surroundings are alike all around.

    way: unit vectors, (S, 3); around: volume of each point [m^3]. A uniaxial strain along a direction m stores
    sum k L0^2 (n m)^4 / 2 about a point, and 3 mu V / 2 in such a solid: weights are raised and lowered by how much is
    missing (ISRA, De Pierro 1987), which keeps them from changing sign.
    """
    rows, columns = ends.T.ravel(), np.tile(np.arange(len(ends)), 2)
    half = sparse.coo_matrix((np.full(2 * len(ends), 0.5), (rows, columns)), (len(around), len(ends))).tocsr()
    n = np.arange(DIRECTIONS) + 0.5
    polar, turn = np.arccos(1 - n / DIRECTIONS), np.pi * (1 + math.sqrt(5)) * n
    directions = np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)])
    stored = (way @ directions) ** 4
    wanted = (half.T @ np.repeat(3 * around[:, None], DIRECTIONS, 1) * stored).sum(1)
    weight = half.T @ (15 * around / (half @ np.ones(len(ends))))
    for _ in range(ROUNDS):
        weight *= (wanted / (half.T @ (half @ (weight[:, None] * stored)) * stored).sum(1)) ** PACE
    return weight


@njit(cache=True, error_model="numpy")
def pull(
    x, v, dt, keep, ends, length, rest, k, k0, fibre, lag, stiffening, branch, tau, least, bears, creep, plastic, most,
    force,
):  # fmt: skip
    """Add the springs' forces [N]; creep and set [m], and the greatest strain so far, go on where `keep`."""
    for e in range(len(ends)):
        a, b = ends[e, 0], ends[e, 1]
        d0, d1, d2 = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        now = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
        rate = (d0 * (v[b, 0] - v[a, 0]) + d1 * (v[b, 1] - v[a, 1]) + d2 * (v[b, 2] - v[a, 2])) / now
        over = now - rest[e] - plastic[e]
        if least > 0.0:
            beyond = abs(over) - least * length[e]
            if beyond > 0.0:
                gone = beyond if over > 0.0 else -beyond
                over -= gone
                if keep:
                    plastic[e] += gone
        strain = over / length[e]
        f = k[e] * over
        if stiffening > 0.0:
            f *= 1.0 + 3.0 * stiffening * strain * strain
        if bears > 0.0:
            worst = max(most[e], strain * strain)
            if keep:
                most[e] = worst
            if worst > bears:
                f *= 1.0 - TORN * (1.0 - np.sqrt(bears / worst))
        if fibre[e] > 0.0 and over > 0.0:
            f += fibre[e] * over
        if branch > 0.0:
            lack = (now - creep[e]) / (1.0 + dt / tau)
            f += branch * k0[e] * lack
            if keep:
                creep[e] = now - lack
        f += lag * k0[e] * rate
        f /= now
        force[a, 0] += f * d0
        force[a, 1] += f * d1
        force[a, 2] += f * d2
        force[b, 0] -= f * d0
        force[b, 1] -= f * d1
        force[b, 2] -= f * d2


@njit(cache=True, error_model="numpy")
def swell(x, tets, volume, bulk, force):
    """Add forces [N] of tetrahedra that keep their volume; one turned inside out makes them no number."""
    p = np.empty((4, 3))
    for m in range(len(tets)):
        for k in range(4):
            for i in range(3):
                p[k, i] = x[tets[m, k], i]
        a, b, c, d = p[0], p[1], p[2], p[3]
        ab, ac, ad = b - a, c - a, d - a
        gb, gc, gd = np.cross(ac, ad), np.cross(ad, ab), np.cross(ab, ac)
        now = (ab[0] * gb[0] + ab[1] * gb[1] + ab[2] * gb[2]) / 6
        if now <= 0.02 * volume[m]:
            force[tets[m, 0], 0] = np.nan
            return
        f = -bulk * (now / volume[m] - 1.0) / 6
        for i in range(3):
            force[tets[m, 1], i] += f * gb[i]
            force[tets[m, 2], i] += f * gc[i]
            force[tets[m, 3], i] += f * gd[i]
            force[tets[m, 0], i] -= f * (gb[i] + gc[i] + gd[i])
