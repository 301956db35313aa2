"""A step of the particles on a CPU, a cell at a time: particles that hang on the same nodes go side by side.

A thread of the launch takes up to eight such particles. What a node gives to all of them is fetched once, and their
sums are vectors of eight, which the compiler puts into wide registers; only the laws are asked particle by particle.
The loads are added straight into the nodes: a launch on a CPU is one thread, and each of several has its own sums.
"""

from functools import cache
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import warp as wp

from surgisim.mpm.grid import cells_of
from surgisim.mpm.kernels import law_functions, shapes
from surgisim.mpm.march import Phases

LANES = 8
"""Particles side by side."""


class ByCell:
    """A body's particles in cells of at most LANES, shared out over threads."""

    ticks = False
    """The clock has a kernel of its own."""

    def __init__(self, local: np.ndarray, links: np.ndarray, count: int, terms, precision: str, threads: int, put):
        """local (P, K) and links (P, K, 4): nodes, of which there are `count`; put(array, dtype) -> device array."""
        self.kernels = cell_kernels(terms, precision)
        self.laws, self.order = self.kernels.laws, np.arange(len(local))
        nodes, cell, width, links = cells_of(local, links)
        sort = np.argsort(cell, kind="stable")
        place = np.arange(len(cell)) - np.searchsorted(cell[sort], cell[sort])
        # A crowded cell is several: (cell, round) pairs in order.
        pair = cell[sort] * (1 + place.max(initial=0) // LANES) + place // LANES
        kept, row = np.unique(pair, return_inverse=True)
        member = np.full((len(kept), LANES), -1, np.int32)
        member[row, place % LANES] = sort
        owner = np.zeros(len(kept), int)
        owner[row] = cell[sort]
        wide = np.where((member >= 0)[:, :, None, None], links[member], 0)
        self.links = [put(nodes[owner], int), put(wide.transpose(0, 2, 3, 1), lanes(precision).Row), put(member, int)]
        self.links.append(put(width[owner], int))
        ends = np.linspace(0, len(kept), threads + 1).astype(int)
        self.shares = [(int(a), int(b - a)) for a, b in pairwise(ends)]
        self.parts = len(self.shares)

    def forward(self, clock, inputs: list, force, trouble) -> Phases:
        """From a state to the forces on the nodes; inputs as in the kernels."""
        return [self._cells(self.kernels.step, clock, inputs, [force, trouble])]

    def back(self, clock, inputs: list, f_bar, u_bar, v_bar, sums: list) -> Phases:
        """From the derivatives by force to those by displacement and velocity; sums as in the kernels."""
        return [self._cells(self.kernels.adjoint, clock, inputs, [f_bar, u_bar, v_bar, *sums])]

    def _cells(self, kernel, clock, inputs: list, outs: list) -> list[wp.Launch]:
        """One launch for each thread."""
        return [
            wp.launch(kernel, size, [clock, *self.links, *inputs, part, begin, *outs], device="cpu", record_cmd=True)
            for part, (begin, size) in enumerate(self.shares)
        ]


@cache
def lanes(precision: str) -> SimpleNamespace:
    """A number of every particle of a cell, and a vector of each."""
    real = shapes(precision).real
    return SimpleNamespace(Row=wp.types.vector(LANES, real), Rows=wp.types.matrix((3, LANES), real))


@cache
def cell_kernels(names: tuple[str, ...], precision: str = "single") -> SimpleNamespace:
    """`step` and `adjoint` over cells, compiled for these laws.

    nodes (C, K) of each cell, of which the first width (C,) count; link (C, K, 4): weight and gradient of every
    particle in it; member (C, LANES): which particles those are, -1 where a lane is empty.
    """
    functions, s, wide = law_functions(names, precision), shapes(precision), lanes(precision)
    laws, answer, answer_back = functions.laws, functions.answer, functions.answer_back
    real, Vec, Mat, Anchors, Memory, Row, Rows = s.real, s.Vec, s.Mat, s.Anchors, laws.Memory, wide.Row, wide.Rows

    @wp.func
    def column(rows: Rows, j: int):
        return Vec(rows[0, j], rows[1, j], rows[2, j])

    @wp.func
    def carried(
        field: wp.array2d(dtype=Vec),
        nodes: wp.array2d(dtype=int),
        link: wp.array3d(dtype=Row),
        width: int,
        slot: int,
        c: int,
    ):
        total = Rows()
        for k in range(width):
            total += wp.outer(field[slot, nodes[c, k]], link[c, k, 0])
        return total

    @wp.func
    def gripped(anchors: Anchors, member: wp.array2d(dtype=int), c: int):
        held = int(0)
        for j in range(member.shape[1]):
            if member[c, j] >= 0:
                held |= anchors.member[member[c, j]]
        return held

    @wp.kernel(module="unique", enable_backward=False)
    def step(
        clock: wp.array(dtype=int),
        nodes: wp.array2d(dtype=int),
        link: wp.array3d(dtype=Row),
        member: wp.array2d(dtype=int),
        width: wp.array(dtype=int),
        volume: wp.array(dtype=real),
        rho: wp.array(dtype=real),
        rest: wp.array(dtype=Vec),
        theta: wp.array2d(dtype=real),
        anchors: Anchors,
        dt: real,
        slots: int,
        u: wp.array2d(dtype=Vec),
        v: wp.array2d(dtype=Vec),
        q: wp.array2d(dtype=Memory),
        part: int,
        begin: int,
        force: wp.array2d(dtype=Vec),
        trouble: wp.array2d(dtype=int),
    ):
        c = begin + wp.tid()
        n = clock[1]
        slot = clock[0] % slots
        Fx, Fy, Fz = Rows(), Rows(), Rows()
        Gx, Gy, Gz = Rows(), Rows(), Rows()
        for k in range(width[c]):
            i = nodes[c, k]
            Fx += wp.outer(u[slot, i], link[c, k, 1])
            Fy += wp.outer(u[slot, i], link[c, k, 2])
            Fz += wp.outer(u[slot, i], link[c, k, 3])
            Gx += wp.outer(v[slot, i], link[c, k, 1])
            Gy += wp.outer(v[slot, i], link[c, k, 2])
            Gz += wp.outer(v[slot, i], link[c, k, 3])
        X, Y = Rows(), Rows()
        held = gripped(anchors, member, c)
        if wp.static(laws.forces):
            X = carried(u, nodes, link, width[c], slot, c)
            Y = carried(v, nodes, link, width[c], slot, c)
        elif held > 0:
            X = carried(u, nodes, link, width[c], slot, c)
        Px, Py, Pz, B = Rows(), Rows(), Rows(), Rows()
        for j in range(member.shape[1]):
            p = member[c, j]
            if p >= 0:
                F = wp.identity(n=3, dtype=real) + wp.matrix_from_cols(column(Fx, j), column(Fy, j), column(Fz, j))
                Fdot = wp.matrix_from_cols(column(Gx, j), column(Gy, j), column(Gz, j))
                P, b = answer(
                    F, Fdot, column(X, j), column(Y, j), p, n, slot, (clock[0] + 1) % slots, dt, part, volume, rho,
                    rest, theta, anchors, q, trouble,
                )  # fmt: skip
                for r in range(3):
                    Px[r, j] = P[r, 0]
                    Py[r, j] = P[r, 1]
                    Pz[r, j] = P[r, 2]
                    B[r, j] = b[r]
        loaded = held > 0
        if wp.static(laws.forces):
            loaded = True
        for k in range(width[c]):
            load = -(Px * link[c, k, 1] + Py * link[c, k, 2] + Pz * link[c, k, 3])
            if loaded:
                load += B * link[c, k, 0]
            wp.atomic_add(force, part, nodes[c, k], load)

    @wp.kernel(module="unique", enable_backward=False)
    def adjoint(
        clock: wp.array(dtype=int),
        nodes: wp.array2d(dtype=int),
        link: wp.array3d(dtype=Row),
        member: wp.array2d(dtype=int),
        width: wp.array(dtype=int),
        volume: wp.array(dtype=real),
        rho: wp.array(dtype=real),
        rest: wp.array(dtype=Vec),
        theta: wp.array2d(dtype=real),
        anchors: Anchors,
        dt: real,
        slots: int,
        u: wp.array2d(dtype=Vec),
        v: wp.array2d(dtype=Vec),
        q: wp.array2d(dtype=Memory),
        part: int,
        begin: int,
        f_bar: wp.array(dtype=Vec),
        u_bar: wp.array2d(dtype=Vec),
        v_bar: wp.array2d(dtype=Vec),
        q_bar: wp.array(dtype=Memory),
        theta_bar: wp.array2d(dtype=real),
        rho_bar: wp.array(dtype=real),
        path_bar: wp.array3d(dtype=Vec),
        hold_bar: wp.array3d(dtype=real),
        stiffness_bar: wp.array2d(dtype=Mat),
    ):
        c = begin + wp.tid()
        n = clock[1]
        slot = clock[0] % slots
        Fx, Fy, Fz = Rows(), Rows(), Rows()
        Gx, Gy, Gz = Rows(), Rows(), Rows()
        Ax, Ay, Az, B = Rows(), Rows(), Rows(), Rows()
        for k in range(width[c]):
            i = nodes[c, k]
            Fx += wp.outer(u[slot, i], link[c, k, 1])
            Fy += wp.outer(u[slot, i], link[c, k, 2])
            Fz += wp.outer(u[slot, i], link[c, k, 3])
            Gx += wp.outer(v[slot, i], link[c, k, 1])
            Gy += wp.outer(v[slot, i], link[c, k, 2])
            Gz += wp.outer(v[slot, i], link[c, k, 3])
            Ax -= wp.outer(f_bar[i], link[c, k, 1])
            Ay -= wp.outer(f_bar[i], link[c, k, 2])
            Az -= wp.outer(f_bar[i], link[c, k, 3])
            B += wp.outer(f_bar[i], link[c, k, 0])
        X, Y = Rows(), Rows()
        held = gripped(anchors, member, c)
        if wp.static(laws.forces):
            X = carried(u, nodes, link, width[c], slot, c)
            Y = carried(v, nodes, link, width[c], slot, c)
        elif held > 0 and stiffness_bar.shape[1] > 0:
            X = carried(u, nodes, link, width[c], slot, c)
        dX, dY = Rows(), Rows()
        for j in range(member.shape[1]):
            p = member[c, j]
            if p >= 0:
                F = wp.identity(n=3, dtype=real) + wp.matrix_from_cols(column(Fx, j), column(Fy, j), column(Fz, j))
                Fdot = wp.matrix_from_cols(column(Gx, j), column(Gy, j), column(Gz, j))
                A = wp.matrix_from_cols(column(Ax, j), column(Ay, j), column(Az, j))
                dF, dFdot, dx, dy = answer_back(
                    F, Fdot, column(X, j), column(Y, j), A, column(B, j), p, n, slot, dt, part, volume, rho, rest,
                    theta, anchors, q, q_bar, theta_bar, rho_bar, path_bar, hold_bar, stiffness_bar,
                )  # fmt: skip
                for r in range(3):
                    Fx[r, j] = dF[r, 0]
                    Fy[r, j] = dF[r, 1]
                    Fz[r, j] = dF[r, 2]
                    Gx[r, j] = dFdot[r, 0]
                    Gy[r, j] = dFdot[r, 1]
                    Gz[r, j] = dFdot[r, 2]
                    dX[r, j] = dx[r]
                    dY[r, j] = dy[r]
        loaded = held > 0
        if wp.static(laws.forces):
            loaded = True
        for k in range(width[c]):
            du = Fx * link[c, k, 1] + Fy * link[c, k, 2] + Fz * link[c, k, 3]
            dv = Gx * link[c, k, 1] + Gy * link[c, k, 2] + Gz * link[c, k, 3]
            if loaded:
                du += dX * link[c, k, 0]
                dv += dY * link[c, k, 0]
            wp.atomic_add(u_bar, part, nodes[c, k], du)
            wp.atomic_add(v_bar, part, nodes[c, k], dv)

    return SimpleNamespace(step=step, adjoint=adjoint, laws=laws)
