"""Runs of one body: forward, and back through every step.

Memory of a backward run: one state a frame plus one state a step of a single frame. The segment
between two frames is computed again before it is walked back, so an adjoint costs one extra
forward and no more memory however long the clip.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import warp as wp
from scipy import sparse

from surgisim.mpm.cut import Cut
from surgisim.mpm.extension import extension
from surgisim.mpm.grid import Grid
from surgisim.mpm.grip import Drive
from surgisim.mpm.kernels import (
    Anchors,
    node_adjoint_before,
    node_adjoint_gather,
    node_gather,
    node_step,
    particle_kernels,
    tick,
)
from surgisim.problem import Problem

wp.config.log_level = wp.LOG_WARNING

NEVER = 2**31 - 1


class Breakdown(Problem):
    """A run that cannot go on: inverted tissue or a number that is none, with step and place."""


@dataclass(frozen=True)
class Run:
    """What a forward run leaves: enough to draw it, to judge it and to walk it back."""

    u: np.ndarray
    """Nodal displacement at every frame [m], (T, A, 3) float32, over solid nodes."""
    v: np.ndarray
    """Nodal velocity at every frame [m/s], (T, A, 3) float32."""


class Simulator:
    """A body on its grid, ready to run. One instance per thread: it owns its device arrays."""

    def __init__(
        self,
        *,
        rest: np.ndarray,
        volume: np.ndarray,
        density: float,
        grid: Grid,
        terms: tuple[str, ...],
        gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
        cut: Cut | None = None,
        device: str = "cpu",
    ) -> None:
        """Particles `rest` [m], (P, 3), of `volume` [m^3], (P,)."""
        self.rest, self.grid, self.terms, self.device = np.asarray(rest, float), grid, tuple(terms), device
        self.count, self.cut = len(rest), cut
        nodes, weight, _ = self.stencil(self.rest)
        mass_p = volume.astype(float) * density
        sides = 1 if cut is None else 2
        mass = np.bincount(nodes.ravel(), (weight * mass_p[:, None]).ravel(), sides * grid.count)
        self.place, self.rule = extension(grid, mass, cut)
        local, links = self.links(self.rest)
        mass = np.bincount(local.ravel(), (links[..., 0] * mass_p[:, None]).ravel(), len(self.place))
        order = np.argsort(local.ravel(), kind="stable").astype(np.int32)
        start = np.searchsorted(local.ravel()[order], np.arange(len(self.place) + 1)).astype(np.int32)

        def put(array, dtype):
            return wp.array(np.ascontiguousarray(array), dtype=dtype, device=device)

        self.index, self.link = put(local, int), put(links.astype(np.float32), wp.vec4)
        self.start, self.entry = put(start, int), put(order, int)
        self.volume, self.mass_p = put(volume.astype(np.float32), float), put(mass_p.astype(np.float32), float)
        self.mass = put(mass.astype(np.float32), float)
        self.gravity = wp.vec3(*gravity)
        self.stress = wp.zeros(self.count, dtype=wp.mat33, device=device)
        self.push = wp.zeros(self.count, dtype=wp.vec3, device=device)
        self.clock = wp.zeros(2, dtype=int, device=device)
        self.trouble = put(np.array([NEVER, 0]), int)
        self.force = wp.zeros(len(self.place), dtype=wp.vec3, device=device)
        self.scatter = not wp.get_device(device).is_cuda
        self.kernels = particle_kernels(self.terms, self.scatter)
        # Loaded here, once: two threads that load one module at their first launch crash the process.
        for kernel in (self.kernels.step, self.kernels.adjoint, node_step):
            wp.load_module(kernel.module, device=device)

    # Forward

    def run(
        self,
        theta: np.ndarray,
        drive: Drive,
        *,
        begin: tuple[np.ndarray, np.ndarray] | None = None,
        first: int = 0,
        last: int | None = None,
        progress: Callable[[float, float, str], None] | None = None,
    ) -> Run:
        """Frames `first` to `last` of the drive, from state `begin` (u, v over solid nodes; rest if None).

        theta: parameters, one row a particle, (P, M). Raises Problem where a particle inverts or a
        number stops being finite, naming step and particle.
        """
        last = drive.frames - 1 if last is None else last
        anchors, theta_d = self._anchors(drive), self._theta(theta)
        u, v = self._slots(2)
        if begin is not None:
            u[0].assign(begin[0])
            v[0].assign(begin[1])
        self._reset(first * drive.per_frame)
        us, vs = [u.numpy()[0].copy()], [v.numpy()[0].copy()]
        commands = self._commands(theta_d, anchors, drive.step, 2, u, v)
        for frame in range(first, last):
            self._advance(commands, drive.per_frame)
            slot = (frame + 1 - first) * drive.per_frame % 2
            us.append(u.numpy()[slot].copy())
            vs.append(v.numpy()[slot].copy())
            self._check(us[-1], drive, frame)
            if progress:
                progress(frame + 1 - first, last - first, f"frame {frame + 1}/{drive.frames - 1}")
        return Run(np.stack(us), np.stack(vs))

    # Backward

    def gradient(self, theta: np.ndarray, drive: Drive, run: Run, u_bar: np.ndarray, *, first: int = 0) -> np.ndarray:
        """Derivative of a loss with respect to theta, (P, M), given its derivative `u_bar` (T, A, 3) by `run.u`."""
        anchors, theta_d = self._anchors(drive), self._theta(theta)
        per = drive.per_frame
        u, v = self._slots(per + 1)
        forward = self._commands(theta_d, anchors, drive.step, per + 1, u, v)
        ub, vb = (wp.zeros(len(self.place), dtype=wp.vec3, device=self.device) for _ in range(2))
        theta_bar = wp.zeros_like(theta_d)
        backward = self._adjoint_commands(theta_d, anchors, drive.step, per + 1, u, v, ub, vb, theta_bar)
        ub.assign(u_bar[-1].astype(np.float32))
        for frame in range(len(run.u) - 1, 0, -1):
            if not (ub.numpy().any() or vb.numpy().any()):
                ub.assign(u_bar[frame - 1].astype(np.float32))
                continue
            u[0].assign(run.u[frame - 1])
            v[0].assign(run.v[frame - 1])
            self._reset((first + frame - 1) * per)
            self._advance(forward, per)
            for _ in range(per):
                for command in backward:
                    command.launch()
            total = ub.numpy() + u_bar[frame - 1]
            if not np.isfinite(total).all():
                raise Problem(
                    f"adjoint: a derivative is not finite at frame {first + frame - 1}. "
                    "The run is unstable there: take a smaller step."
                )
            ub.assign(total.astype(np.float32))
        return theta_bar.numpy().astype(float)

    def stencil(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As Grid.stencil; a link across the cut leads to the node's copy on the point's own side, N further on."""
        nodes, weight, gradient = self.grid.stencil(points)
        if self.cut is not None:
            across = self.cut.crosses(points[:, None], self.grid.positions()[nodes])
            nodes = nodes + across.astype(np.int32) * self.grid.count
        return nodes, weight, gradient

    def links(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Solid nodes (Q, L) that carry points [m], (Q, 3), with weight and its gradient [1, 1/m], (Q, L, 4).

        Rows shorter than the longest are padded with links of weight zero to their first node.
        """
        nodes, weight, gradient = self.stencil(points)
        rows = np.repeat(np.arange(len(nodes)), 27)
        size = (len(nodes), self.rule.shape[0])
        parts = [
            (sparse.csr_matrix((values.ravel(), (rows, nodes.ravel())), size) @ self.rule).tocsr()
            for values in (weight, *np.moveaxis(gradient, -1, 0))
        ]
        # One pattern for the four: where one of them happens to be zero, the others need not be.
        pattern = sum(abs(p) for p in parts).tocsr()
        pattern.sort_indices()
        lengths = np.diff(pattern.indptr)
        row = np.repeat(np.arange(len(nodes)), lengths)
        column = np.arange(pattern.nnz) - np.repeat(pattern.indptr[:-1], lengths)
        index = np.zeros((len(nodes), max(1, int(lengths.max(initial=1)))), np.int32)
        first = np.where(lengths > 0, pattern.indices[np.minimum(pattern.indptr[:-1], max(pattern.nnz - 1, 0))], 0)
        index[:] = first[:, None]
        index[row, column] = pattern.indices
        link = np.zeros((*index.shape, 4))
        for k, part in enumerate(parts):
            link[row, column, k] = np.asarray(part[row, pattern.indices]).ravel()
        return index, link

    def carry(self, points: np.ndarray) -> sparse.csr_matrix:
        """Interpolation from solid nodes to points [m], (Q, 3), (Q, A); rows far from the body sum to less than 1."""
        index, link = self.links(points)
        rows = np.repeat(np.arange(len(index)), index.shape[1])
        return sparse.csr_matrix((link[..., 0].ravel(), (rows, index.ravel())), (len(index), len(self.place)))

    def displaced(self, u: np.ndarray) -> np.ndarray:
        """Nodal displacement [m], (..., N, 3) or (..., 2 N, 3) once cut, of every node that follows the body."""
        flat = np.moveaxis(u.astype(float), -2, 0).reshape(len(self.place), -1)
        return np.moveaxis((self.rule @ flat).reshape(-1, *u.shape[:-2], 3), 0, -2)

    def inherited(self, other: "Simulator", u: np.ndarray) -> np.ndarray:
        """Nodal values of `other`, (A', 3), over this simulator's nodes, (A, 3): both copies start as the node did."""
        return other.displaced(u)[self.place % self.grid.count].astype(np.float32)

    # Parts

    def _slots(self, count: int):
        shape = (count, len(self.place))
        return tuple(wp.zeros(shape, dtype=wp.vec3, device=self.device) for _ in range(2))

    def _theta(self, theta: np.ndarray):
        theta = np.ascontiguousarray(theta, np.float32)
        if theta.shape != (self.count, self.kernels.columns):
            raise Problem(f"theta is {theta.shape}, but ({self.count}, {self.kernels.columns}) is wanted.")
        return wp.array(theta, dtype=float, device=self.device)

    def _anchors(self, drive: Drive) -> Anchors:
        anchors = Anchors()
        anchors.member = wp.array(drive.member.astype(np.int32), dtype=int, device=self.device)
        anchors.path = wp.array(drive.path.astype(np.float32), dtype=wp.vec3, device=self.device)
        anchors.active = wp.array(drive.active.astype(np.int32), dtype=int, device=self.device)
        anchors.stiffness = wp.array(drive.stiffness.astype(np.float32), dtype=float, device=self.device)
        return anchors

    def _reset(self, step: int) -> None:
        self.clock.assign(np.array([0, step], np.int32))
        self.trouble.assign(np.array([NEVER, 0], np.int32))

    def _particles(self, kernel, theta, anchors, slots, u, v, rest):
        common = [self.clock, self.index, self.link, self.volume, self.mass_p, theta, anchors, slots, u, v]
        return wp.launch(kernel, self.count, common + rest, device=self.device, record_cmd=True)

    def _commands(self, theta, anchors, dt, slots, u, v):
        launch = {"device": self.device, "record_cmd": True}
        outs = [self.stress, self.push, self.force, self.trouble]
        particles = self._particles(self.kernels.step, theta, anchors, slots, u, v, outs)
        nodes = [self.clock, self.mass, self.gravity, dt, slots, self.force, u, v]
        step = wp.launch(node_step, len(self.place), nodes, **launch)
        forward = wp.launch(tick, 1, [self.clock, 1], **launch)
        if self.scatter:
            return [particles, step, forward]
        links = [self.start, self.entry, self.link, self.stress, self.push, self.force]
        return [particles, wp.launch(node_gather, len(self.place), links, **launch), step, forward]

    def _adjoint_commands(self, theta, anchors, dt, slots, u, v, ub, vb, theta_bar):
        launch = {"device": self.device, "record_cmd": True}
        fb, xb = (wp.zeros(n, dtype=wp.vec3, device=self.device) for n in (len(self.place), self.count))
        Fb, Gb = (wp.zeros(self.count, dtype=wp.mat33, device=self.device) for _ in range(2))
        backward = wp.launch(tick, 1, [self.clock, -1], **launch)
        before = wp.launch(node_adjoint_before, len(self.place), [self.mass, dt, ub, vb, fb], **launch)
        outs = [fb, Fb, Gb, xb, ub, vb, theta_bar]
        particles = self._particles(self.kernels.adjoint, theta, anchors, slots, u, v, outs)
        if self.scatter:
            return [backward, before, particles]
        links = [self.start, self.entry, self.link, Fb, Gb, xb, ub, vb]
        return [backward, before, particles, wp.launch(node_adjoint_gather, len(self.place), links, **launch)]

    def _advance(self, commands, steps: int) -> None:
        for _ in range(steps):
            for command in commands:
                command.launch()

    def _check(self, u: np.ndarray, drive: Drive, frame: int) -> None:
        step, particle = self.trouble.numpy()
        if step != NEVER:
            where = np.round(self.rest[particle], 4).tolist()
            raise Breakdown(
                f"simulation: particle {particle} at rest position {where} m turned inside out (or stopped being a "
                f"number) at step {step} ({step * drive.step:.4f} s). Its load is too violent for this tissue or the "
                "step too large: take a smaller step, a gentler motion, or a stiffer tissue."
            )
        if not np.isfinite(u).all():
            raise Breakdown(
                f"simulation: a displacement is not finite between frames {frame} and {frame + 1}. Take a smaller step."
            )
