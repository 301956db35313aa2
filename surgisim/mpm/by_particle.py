"""A step of the particles on a GPU, one thread each: stress and force are left for the nodes to gather."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import warp as wp

from surgisim.mpm.grid import cells_of
from surgisim.mpm.kernels import ABREAST, law_functions, node_kernels, shapes
from surgisim.mpm.march import Phases

PIECE = 32
"""Sums of cells that a thread adds up for a node; functions of a grip hang on hundreds, which several threads share."""
BLOCK = 64
"""Particles that are stepped in one block: few, so that no multiprocessor waits for the last one."""


class ByParticle:
    """A body's particles, sorted by the nodes they hang on, and the sums from them to the nodes."""

    ticks = True
    """The clock moves on while particles are lumped."""

    def __init__(self, local: np.ndarray, links: np.ndarray, count: int, terms, precision: str, threads: int, put):
        """local (P, K) and links (P, K, 4): nodes, of which there are `count`; put(array, dtype) -> device array."""
        s = shapes(precision)
        self.kernels, self.node_kernels = particle_kernels(terms, precision), node_kernels(precision)
        self.laws, self.types = self.kernels.laws, s
        nodes, cell, width, links = cells_of(*(_padded(a) for a in (local, links)))
        self.order = np.argsort(cell, kind="stable")
        # Neighbouring threads, which step neighbouring particles, read neighbouring numbers; cells read whole rows.
        self.rows = put(links[self.order], s.Link)
        self.links = [
            put(np.swapaxes(a[self.order], 0, 1), kind).transpose() for a, kind in ((nodes[cell], int), (links, s.Link))
        ]
        self.links.append(put(-(-width // ABREAST)[cell][self.order], int))
        # Rows of odd length: at powers of two the sums of neighbouring cells push each other out of the cache.
        self.shape, self.stride = nodes.shape, nodes.shape[1] | 1
        self.begin = put(np.searchsorted(np.sort(cell), np.arange(len(nodes) + 1)), int)
        used = np.arange(nodes.shape[1]) < width[:, None]
        at = np.arange(len(nodes))[:, None] * self.stride + np.arange(nodes.shape[1])
        start, entry, node, part = _pieces(nodes[used], at[used], filler=self.sums)
        self.parts = int(part.max()) + 1
        self.pieces = [put(a, int) for a in (start, entry, node, part)]

    @property
    def sums(self) -> int:
        """Sums of the cells; one more stays zero."""
        return self.shape[0] * self.stride

    def forward(self, clock, inputs: list, force, trouble) -> Phases:
        """From a state to the forces on the nodes; inputs as in the kernels."""
        stress, push = (
            wp.zeros(len(self.order), dtype=t, device=clock.device) for t in (self.types.Mat, self.types.Vec)
        )
        outs = [stress, push, trouble]
        return [self._particles(self.kernels.step, clock, inputs, outs), *self._gathered(clock, "", outs[:2], [force])]

    def back(self, clock, inputs: list, f_bar, u_bar, v_bar, sums: list) -> Phases:
        """From the derivatives by force to those by displacement and velocity; sums as in the kernels."""
        t = self.types
        own = [wp.zeros(len(self.order), dtype=kind, device=clock.device) for kind in (t.Mat, t.Mat, t.Vec, t.Vec)]
        return [
            self._particles(self.kernels.adjoint, clock, inputs, [f_bar, *own, *sums]),
            *self._gathered(clock, "_back", own, [u_bar, v_bar]),
        ]

    def _particles(self, kernel, clock, inputs: list, outs: list) -> list[wp.Launch]:
        values = [clock, *self.links, *inputs, *outs]
        return [wp.launch(kernel, len(self.order), values, device=clock.device, record_cmd=True, block_dim=BLOCK)]

    def _gathered(self, clock, way: str, per_particle: list, at_nodes: list) -> Phases:
        """Sums over the particles of every node, in two phases."""
        launch = {"device": clock.device, "record_cmd": True}
        sums = [wp.zeros(self.sums + 1, dtype=self.types.Vec, device=clock.device) for _ in at_nodes]
        lump, gather = (getattr(self.node_kernels, f"{name}{way}") for name in ("lump", "gather"))
        lumped = [clock, self.begin, self.rows, *per_particle, self.stride, *sums]
        return [
            [wp.launch(lump, self.shape, lumped, **launch)],
            [wp.launch(gather, len(self.pieces[-1]), [*self.pieces, *sums, *at_nodes], **launch)],
        ]


def _padded(rows: np.ndarray) -> np.ndarray:
    """Rows (P, K, ...) made longer to a multiple of ABREAST, by their first node with links of weight zero."""
    filler = rows[:, :1] if rows.ndim == 2 else np.zeros_like(rows[:, :1])
    return np.concatenate([rows, np.repeat(filler, -rows.shape[1] % ABREAST, 1)], 1)


def _pieces(node: np.ndarray, at: np.ndarray, filler: int) -> tuple[np.ndarray, ...]:
    """Every `at` of a `node`, in pieces of at most PIECE: where each of N pieces starts, (N + 1,), and what all hold.

    Also whose it is and which of that node's, (N,) each. Pieces hold a multiple of ABREAST, with `filler` at their end.
    """
    order = np.argsort(node, kind="stable")
    held = np.bincount(node)
    rank = np.arange(len(node)) - np.repeat(np.cumsum(held) - held, held)
    begins = np.flatnonzero(rank % PIECE == 0)
    length = np.diff(np.append(begins, len(node)))
    start = np.concatenate([[0], np.cumsum(-(-length // ABREAST) * ABREAST)])
    entry = np.full(start[-1], filler)
    entry[np.repeat(start[:-1] - begins, length) + np.arange(len(node))] = at[order]
    return start, entry, node[order][begins], rank[begins] // PIECE


@cache
def particle_kernels(names: tuple[str, ...], precision: str = "single") -> SimpleNamespace:
    """`step` and `adjoint` over particles, compiled for these laws."""
    functions, s = law_functions(names, precision), shapes(precision)
    laws, answer, answer_back = functions.laws, functions.answer, functions.answer_back
    real, Vec, Mat, Link, Anchors, Memory = s.real, s.Vec, s.Mat, s.Link, s.Anchors, laws.Memory

    @wp.func
    def kinematics(
        u: wp.array2d(dtype=Vec),
        v: wp.array2d(dtype=Vec),
        index: wp.array2d(dtype=int),
        link: wp.array2d(dtype=Link),
        blocks: wp.array(dtype=int),
        slot: int,
        p: int,
    ):
        f00, f01, f02 = real(1.0), real(0.0), real(0.0)
        f10, f11, f12 = real(0.0), real(1.0), real(0.0)
        f20, f21, f22 = real(0.0), real(0.0), real(1.0)
        d00, d01, d02 = real(0.0), real(0.0), real(0.0)
        d10, d11, d12 = real(0.0), real(0.0), real(0.0)
        d20, d21, d22 = real(0.0), real(0.0), real(0.0)
        for block in range(blocks[p]):
            for j in range(wp.static(ABREAST)):
                k = block * wp.static(ABREAST) + j
                i = index[p, k]
                w = link[p, k]
                a = u[slot, i]
                b = v[slot, i]
                f00 += a[0] * w[1]
                f01 += a[0] * w[2]
                f02 += a[0] * w[3]
                f10 += a[1] * w[1]
                f11 += a[1] * w[2]
                f12 += a[1] * w[3]
                f20 += a[2] * w[1]
                f21 += a[2] * w[2]
                f22 += a[2] * w[3]
                d00 += b[0] * w[1]
                d01 += b[0] * w[2]
                d02 += b[0] * w[3]
                d10 += b[1] * w[1]
                d11 += b[1] * w[2]
                d12 += b[1] * w[3]
                d20 += b[2] * w[1]
                d21 += b[2] * w[2]
                d22 += b[2] * w[3]
        F = Mat(f00, f01, f02, f10, f11, f12, f20, f21, f22)
        Fdot = Mat(d00, d01, d02, d10, d11, d12, d20, d21, d22)
        return F, Fdot

    @wp.func
    def kinematics_and_forces(
        u: wp.array2d(dtype=Vec),
        v: wp.array2d(dtype=Vec),
        f_bar: wp.array(dtype=Vec),
        index: wp.array2d(dtype=int),
        link: wp.array2d(dtype=Link),
        blocks: wp.array(dtype=int),
        slot: int,
        p: int,
    ):
        f00, f01, f02 = real(1.0), real(0.0), real(0.0)
        f10, f11, f12 = real(0.0), real(1.0), real(0.0)
        f20, f21, f22 = real(0.0), real(0.0), real(1.0)
        d00, d01, d02 = real(0.0), real(0.0), real(0.0)
        d10, d11, d12 = real(0.0), real(0.0), real(0.0)
        d20, d21, d22 = real(0.0), real(0.0), real(0.0)
        a00, a01, a02 = real(0.0), real(0.0), real(0.0)
        a10, a11, a12 = real(0.0), real(0.0), real(0.0)
        a20, a21, a22 = real(0.0), real(0.0), real(0.0)
        g0, g1, g2 = real(0.0), real(0.0), real(0.0)
        for block in range(blocks[p]):
            for j in range(wp.static(ABREAST)):
                k = block * wp.static(ABREAST) + j
                i = index[p, k]
                w = link[p, k]
                a = u[slot, i]
                b = v[slot, i]
                f = f_bar[i]
                f00 += a[0] * w[1]
                f01 += a[0] * w[2]
                f02 += a[0] * w[3]
                f10 += a[1] * w[1]
                f11 += a[1] * w[2]
                f12 += a[1] * w[3]
                f20 += a[2] * w[1]
                f21 += a[2] * w[2]
                f22 += a[2] * w[3]
                d00 += b[0] * w[1]
                d01 += b[0] * w[2]
                d02 += b[0] * w[3]
                d10 += b[1] * w[1]
                d11 += b[1] * w[2]
                d12 += b[1] * w[3]
                d20 += b[2] * w[1]
                d21 += b[2] * w[2]
                d22 += b[2] * w[3]
                a00 -= f[0] * w[1]
                a01 -= f[0] * w[2]
                a02 -= f[0] * w[3]
                a10 -= f[1] * w[1]
                a11 -= f[1] * w[2]
                a12 -= f[1] * w[3]
                a20 -= f[2] * w[1]
                a21 -= f[2] * w[2]
                a22 -= f[2] * w[3]
                g0 += f[0] * w[0]
                g1 += f[1] * w[0]
                g2 += f[2] * w[0]
        F = Mat(f00, f01, f02, f10, f11, f12, f20, f21, f22)
        Fdot = Mat(d00, d01, d02, d10, d11, d12, d20, d21, d22)
        A = Mat(a00, a01, a02, a10, a11, a12, a20, a21, a22)
        return F, Fdot, A, Vec(g0, g1, g2)

    @wp.func
    def carried(
        field: wp.array2d(dtype=Vec),
        index: wp.array2d(dtype=int),
        link: wp.array2d(dtype=Link),
        blocks: wp.array(dtype=int),
        slot: int,
        p: int,
    ):
        total = Vec()
        for k in range(blocks[p] * wp.static(ABREAST)):
            total += link[p, k][0] * field[slot, index[p, k]]
        return total

    @wp.kernel(module="unique", enable_backward=False)
    def step(
        clock: wp.array(dtype=int),
        index: wp.array2d(dtype=int),
        link: wp.array2d(dtype=Link),
        blocks: wp.array(dtype=int),
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
        stress: wp.array(dtype=Mat),
        push: wp.array(dtype=Vec),
        trouble: wp.array2d(dtype=int),
    ):
        p = wp.tid()
        slot = clock[0] % slots
        F, Fdot = kinematics(u, v, index, link, blocks, slot, p)
        x = Vec()
        y = Vec()
        if wp.static(laws.forces):
            x = carried(u, index, link, blocks, slot, p)
            y = carried(v, index, link, blocks, slot, p)
        elif anchors.member[p] > 0:
            x = carried(u, index, link, blocks, slot, p)
        piola, pull = answer(
            F,
            Fdot,
            x,
            y,
            p,
            clock[1],
            slot,
            (clock[0] + 1) % slots,
            dt,
            0,
            volume,
            rho,
            rest,
            theta,
            anchors,
            q,
            trouble,
        )
        stress[p] = piola
        push[p] = pull

    @wp.kernel(module="unique", enable_backward=False)
    def adjoint(
        clock: wp.array(dtype=int),
        index: wp.array2d(dtype=int),
        link: wp.array2d(dtype=Link),
        blocks: wp.array(dtype=int),
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
        f_bar: wp.array(dtype=Vec),
        F_bar: wp.array(dtype=Mat),
        Fdot_bar: wp.array(dtype=Mat),
        x_bar: wp.array(dtype=Vec),
        y_bar: wp.array(dtype=Vec),
        q_bar: wp.array(dtype=Memory),
        theta_bar: wp.array2d(dtype=real),
        rho_bar: wp.array(dtype=real),
        path_bar: wp.array3d(dtype=Vec),
        hold_bar: wp.array3d(dtype=real),
        stiffness_bar: wp.array2d(dtype=Mat),
    ):
        p = wp.tid()
        slot = clock[0] % slots
        F, Fdot, A, b = kinematics_and_forces(u, v, f_bar, index, link, blocks, slot, p)
        x = Vec()
        y = Vec()
        if wp.static(laws.forces):
            x = carried(u, index, link, blocks, slot, p)
            y = carried(v, index, link, blocks, slot, p)
        elif anchors.member[p] > 0 and stiffness_bar.shape[1] > 0:
            x = carried(u, index, link, blocks, slot, p)
        dF, dFdot, dx, dy = answer_back(
            F, Fdot, x, y, A, b, p, clock[1], slot, dt, 0, volume, rho, rest, theta, anchors, q,
            q_bar, theta_bar, rho_bar, path_bar, hold_bar, stiffness_bar,
        )  # fmt: skip
        F_bar[p] = dF
        Fdot_bar[p] = dFdot
        x_bar[p] = dx
        y_bar[p] = dy

    return SimpleNamespace(step=step, adjoint=adjoint, laws=laws)
