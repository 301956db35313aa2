"""The updated-Lagrangian form, as the paper has it: MLS-MPM with APIC transfer.

    (m v)_i = sum_p w_ip (m_p v_p + (m_p C_p - dt 4/dx^2 V_p P_p F_p^T) (x_i - x_p) + dt V_p (b_p + h_p))
    v_p = sum_i w_ip v_i,   C_p = 4/dx^2 sum_i w_ip v_i (x) (x_i - x_p),   F_p <- (I + dt C_p) F_p

Weights follow the particles, so large flow is no problem; but stretched tissue tears by itself, crossing cells makes
noise, and the transfer damps in proportion to the number of steps (docs/verification.md). It is kept to compare with;
it has no adjoint.
Hu et al., A moving least squares material point method with displacement discontinuity and two-way rigid body
coupling, 2018; Jiang et al., The affine particle-in-cell method, 2015.
"""

from collections.abc import Callable
from functools import cache
from types import SimpleNamespace

import numpy as np
import warp as wp
from scipy import sparse
from scipy.sparse.linalg import factorized

from surgisim.mpm.grid import Grid
from surgisim.mpm.grip import Drive
from surgisim.mpm.kernels import shapes, tick
from surgisim.mpm.march import March
from surgisim.mpm.nodes import Nodes
from surgisim.mpm.simulator import NEVER, Breakdown, Run
from surgisim.mpm.tear import Severing
from surgisim.physics.fold import folded
from surgisim.problem import Problem

MARGIN = 3
"""Cells around everything the drive reaches."""


class Updated(Nodes):
    """A body whose weights follow it. As Simulator, but whole runs only, forward only, and uncut."""

    def __init__(
        self,
        *,
        rest: np.ndarray,
        volume: np.ndarray,
        density: float,
        grid: Grid,
        terms: tuple[str, ...],
        gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
        cut: Severing | None = None,
        device: str = "cpu",
    ) -> None:
        """Particles `rest` [m], (P, 3), of `volume` [m^3], (P,). Raises Problem where a cut is asked for."""
        if cut is not None:
            raise Problem("mpm: the updated form cannot cut. Take estimation.form: total.")
        self.rest, self.volume_p, self.density = np.asarray(rest, float), np.asarray(volume, float), float(density)
        self.count, self.terms, self.device, self.gravity = len(rest), tuple(terms), device, gravity
        super().__init__(grid, self.rest, self.volume_p, None)
        weights = self.carry_rest()
        normal = (weights.T @ weights).tocsc()
        ridge = 1e-9 * normal.diagonal().max() * sparse.identity(normal.shape[0], format="csc")
        solve = factorized(normal + ridge)
        self._fit = lambda field: np.stack([solve(weights.T @ field[:, a]) for a in range(3)], -1)
        mass = weights.T @ (self.volume_p * self.density)
        self.mass = wp.array(mass.astype(np.float32), dtype=float, device=device)
        self.kernels, self.types = kernels(self.terms), shapes("single")
        if self.kernels.laws.mass:
            raise Problem(
                f"mpm: the updated form has no place for {self.kernels.laws.mass}. Take estimation.form: total."
            )
        for kernel in (self.kernels.scatter, self.kernels.nodes, self.kernels.gather, self.kernels.clear, tick):
            wp.load_module(kernel.module, device=device)

    def run(
        self,
        theta: np.ndarray,
        drive: Drive,
        *,
        last: int | None = None,
        progress: Callable[[float, float, str], None] | None = None,
    ) -> Run:
        """Frames 0 to `last` of the drive, from rest; u and v are the nodal fields that fit the particles best.

        Raises Breakdown where a particle inverts, leaves the grid, or stops being a number.
        """
        last = drive.frames - 1 if last is None else last
        reach = np.abs(drive.path).max() + MARGIN * self.grid.spacing
        corners = np.stack([self.rest.min(0) - reach, self.rest.max(0) + reach])
        world = Grid.around(corners, self.grid.spacing)
        steps, x, v, trouble = self._launches(theta, drive, world)
        states = [self._state(x, v)]
        for frame in range(last):
            steps.march(drive.per_frame)
            self._check(trouble, drive)
            states.append(self._state(x, v))
            if progress:
                progress(frame + 1, last, f"frame {frame + 1}/{drive.frames - 1}")
        u, speed = (np.stack(part) for part in zip(*states, strict=True))
        return Run(u, speed, np.zeros((len(u), self.count, 0), np.float32))

    def _state(self, x, v) -> tuple[np.ndarray, np.ndarray]:
        fields = (x.numpy().astype(float) - self.rest, v.numpy().astype(float))
        return tuple(self._fit(f).astype(np.float32) for f in fields)

    def _launches(self, theta: np.ndarray, drive: Drive, world: Grid):
        s, laws, k = self.types, self.kernels.laws, self.kernels
        launch = {"device": self.device, "record_cmd": True}

        def put(array, dtype):
            kind = np.int32 if dtype is int else np.float32
            return wp.array(np.ascontiguousarray(array, kind), dtype=dtype, device=self.device)

        rest, x = put(self.rest, s.Vec), put(self.rest, s.Vec)
        v = wp.zeros(self.count, dtype=s.Vec, device=self.device)
        C = wp.zeros(self.count, dtype=s.Mat, device=self.device)
        F = put(np.tile(np.eye(3), (self.count, 1, 1)), s.Mat)
        q = wp.zeros(self.count, dtype=laws.Memory, device=self.device)
        node = wp.zeros(world.count, dtype=s.Link, device=self.device)
        clock, trouble = wp.zeros(2, dtype=int, device=self.device), put([NEVER, 0], int)
        anchors = s.Anchors()
        anchors.member, anchors.share = put(drive.member, int), put(drive.share, s.real)
        anchors.path = put(drive.path, s.Vec)
        anchors.hold, anchors.turning = put(drive.hold, s.real), int(drive.turn is not None)
        anchors.turn = put(np.zeros((1, 1, 3, 3)) if drive.turn is None else drive.turn, s.Mat)
        anchors.center = put(drive.center, s.Vec)
        anchors.stiffness = put(drive.stiffness * self.density, s.Mat)
        place = [s.Vec(*world.origin), float(world.spacing), wp.vec3i(*world.shape.tolist())]
        args = [
            clock, put(self.volume_p, s.real), float(self.density), rest, put(theta, s.real), anchors,
            float(drive.step), *place, x, v, C, F, q, node, trouble,
        ]  # fmt: skip
        launches = [
            wp.launch(k.scatter, self.count, args, **launch),
            wp.launch(k.nodes, world.count, [s.Vec(*self.gravity), float(drive.step), node], **launch),
            wp.launch(k.gather, self.count, [float(drive.step), *place, node, x, v, C, F], **launch),
            wp.launch(k.clear, world.count, [node], **launch),
            wp.launch(tick, 1, [clock, 1], **launch),
        ]
        return March([[one] for one in launches], self.device), x, v, trouble

    def _check(self, trouble, drive: Drive) -> None:
        step, particle = trouble.numpy().tolist()
        if step == NEVER:
            return
        where = np.round(self.rest[particle], 4).tolist()
        raise Breakdown(
            f"simulation: particle {particle} at rest position {where} m turned inside out, left the grid or stopped "
            f"being a number at step {step} ({step * drive.step:.4f} s). Take a smaller step, a gentler motion, or the "
            "total form."
        )


@cache
def kernels(names: tuple[str, ...]) -> SimpleNamespace:
    """`scatter`, `nodes`, `gather` and `clear` of one step, compiled for these laws."""
    laws, s = folded(names), shapes("single")
    Vec, Mat, Anchors, Theta, respond = s.Vec, s.Mat, s.Anchors, laws.Theta, laws.respond

    @wp.func
    def spline(f: float):
        return Vec(0.5 * (1.5 - f) * (1.5 - f), 0.75 - (f - 1.0) * (f - 1.0), 0.5 * (f - 0.5) * (f - 0.5))

    @wp.func
    def corner(x: Vec, origin: Vec, spacing: float):
        local = (x - origin) / spacing
        return wp.vec3i(int(wp.floor(local[0] - 0.5)), int(wp.floor(local[1] - 0.5)), int(wp.floor(local[2] - 0.5)))

    @wp.kernel(module="unique", enable_backward=False)
    def scatter(
        clock: wp.array(dtype=int),
        volume: wp.array(dtype=float),
        rho: float,
        rest: wp.array(dtype=Vec),
        theta: wp.array2d(dtype=float),
        anchors: Anchors,
        dt: float,
        origin: Vec,
        spacing: float,
        shape: wp.vec3i,
        x: wp.array(dtype=Vec),
        v: wp.array(dtype=Vec),
        C: wp.array(dtype=Mat),
        F: wp.array(dtype=Mat),
        q: wp.array(dtype=laws.Memory),
        node: wp.array(dtype=s.Link),
        trouble: wp.array(dtype=int),
    ):
        p = wp.tid()
        n = clock[1]
        base = corner(x[p], origin, spacing)
        inside = int(1)
        for a in range(3):
            if base[a] < 0 or base[a] + 3 > shape[a]:
                inside = 0
        J = wp.determinant(F[p])
        # Written so that a NaN is trouble too.
        if inside == 0 or not (J > 0.0):
            wp.atomic_min(trouble, 0, n)
            trouble[1] = p
            return
        mine = Theta()
        for m in range(wp.static(laws.columns)):
            mine[m] = theta[p, m]
        P, b, after = respond(F[p], C[p] * F[p], x[p] - rest[p], v[p], q[p], mine, float(n) * dt, dt, rho)
        q[p] = after
        pull = b
        held = anchors.member[p]
        if held > 0:
            for a in range(anchors.path.shape[0]):
                if ((held >> a) & 1) == 1 and anchors.hold[a, n] > 0.0:
                    to = anchors.path[a, n]
                    if anchors.turning == 1:
                        arm = rest[p] - anchors.center[a]
                        to += anchors.turn[a, n] * arm - arm
                    pull += (anchors.share[p] * anchors.hold[a, n]) * (anchors.stiffness[a] * (to - (x[p] - rest[p])))
        mass = rho * volume[p]
        affine = mass * C[p] - (dt * 4.0 * volume[p] / (spacing * spacing)) * P * wp.transpose(F[p])
        momentum = mass * v[p] + dt * volume[p] * pull
        f = (x[p] - origin) / spacing - Vec(float(base[0]), float(base[1]), float(base[2]))
        wx = spline(f[0])
        wy = spline(f[1])
        wz = spline(f[2])
        for i in range(3):
            for j in range(3):
                for k in range(3):
                    w = wx[i] * wy[j] * wz[k]
                    d = (Vec(float(i), float(j), float(k)) - f) * spacing
                    mv = w * (momentum + affine * d)
                    at = ((base[0] + i) * shape[1] + base[1] + j) * shape[2] + base[2] + k
                    wp.atomic_add(node, at, s.Link(mv[0], mv[1], mv[2], w * mass))

    @wp.kernel(module="unique", enable_backward=False)
    def nodes(gravity: Vec, dt: float, node: wp.array(dtype=s.Link)):
        i = wp.tid()
        mv = node[i]
        if mv[3] > 0.0:
            node[i] = s.Link(
                mv[0] / mv[3] + dt * gravity[0], mv[1] / mv[3] + dt * gravity[1], mv[2] / mv[3] + dt * gravity[2], mv[3]
            )

    @wp.kernel(module="unique", enable_backward=False)
    def gather(
        dt: float,
        origin: Vec,
        spacing: float,
        shape: wp.vec3i,
        node: wp.array(dtype=s.Link),
        x: wp.array(dtype=Vec),
        v: wp.array(dtype=Vec),
        C: wp.array(dtype=Mat),
        F: wp.array(dtype=Mat),
    ):
        p = wp.tid()
        base = corner(x[p], origin, spacing)
        for a in range(3):
            if base[a] < 0 or base[a] + 3 > shape[a]:
                return
        f = (x[p] - origin) / spacing - Vec(float(base[0]), float(base[1]), float(base[2]))
        wx = spline(f[0])
        wy = spline(f[1])
        wz = spline(f[2])
        speed = Vec()
        B = Mat()
        for i in range(3):
            for j in range(3):
                for k in range(3):
                    w = wx[i] * wy[j] * wz[k]
                    at = ((base[0] + i) * shape[1] + base[1] + j) * shape[2] + base[2] + k
                    g = node[at]
                    vi = Vec(g[0], g[1], g[2])
                    speed += w * vi
                    B += wp.outer(w * vi, (Vec(float(i), float(j), float(k)) - f) * spacing)
        new = (4.0 / (spacing * spacing)) * B
        v[p] = speed
        C[p] = new
        x[p] = x[p] + dt * speed
        F[p] = F[p] + dt * (new * F[p])

    @wp.kernel(module="unique", enable_backward=False)
    def clear(node: wp.array(dtype=s.Link)):
        node[wp.tid()] = s.Link()

    return SimpleNamespace(scatter=scatter, nodes=nodes, gather=gather, clear=clear, laws=laws)
