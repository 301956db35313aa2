"""Runs of one body: forward, and back through every step.

Memory of a backward run: one state a frame plus one state a step of a single frame. The segment
between two frames is computed again before it is walked back, so an adjoint costs one extra
forward and no more memory however long the clip.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import warp as wp

from surgisim.mpm.grid import Grid
from surgisim.mpm.grip import Drive
from surgisim.mpm.kernels import Anchors, node_adjoint_after, node_adjoint_before, node_step, particle_kernels, tick
from surgisim.problem import Problem

wp.config.quiet = True

ANCHOR_STIFFNESS = 4.0
"""Spring of an anchor, in units of (wave speed / spacing)^2 per unit of mass."""
ANCHOR_DAMPING = 0.3
"""Share of critical damping of that spring."""

NEVER = 2**31 - 1


class Breakdown(Problem):
    """A run that cannot go on: inverted tissue or a number that is none, with step and place."""


@dataclass(frozen=True)
class Run:
    """What a forward run leaves: enough to draw it, to judge it and to walk it back."""

    u: np.ndarray
    """Nodal displacement at every frame [m], (T, A, 3) float32, over active nodes."""
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
        wave_speed: float,
        gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
        device: str = "cpu",
    ) -> None:
        """Particles `rest` [m], (P, 3), of `volume` [m^3], (P,); `wave_speed` [m/s] sets the anchors' spring."""
        self.rest, self.grid, self.terms, self.device = np.asarray(rest, float), grid, tuple(terms), device
        self.count = len(rest)
        nodes, weight, gradient = grid.stencil(rest)
        mass_p = volume.astype(float) * density
        mass = np.bincount(nodes.ravel(), (weight * mass_p[:, None]).ravel(), grid.count)
        # Nodes that a particle reaches with a vanishing weight carry no physics, only rounding.
        self.active = mass > 1e-7 * mass.max()
        self.place = np.flatnonzero(self.active)
        renumber = np.full(grid.count, -1, np.int32)
        renumber[self.place] = np.arange(len(self.place), dtype=np.int32)
        local = renumber[nodes]
        links = np.concatenate([weight[..., None], gradient], -1).astype(np.float32)
        links[local < 0] = 0.0
        local[local < 0] = 0
        order = np.argsort(local.ravel(), kind="stable").astype(np.int32)
        start = np.searchsorted(local.ravel()[order], np.arange(len(self.place) + 1)).astype(np.int32)

        def put(array, dtype):
            return wp.array(np.ascontiguousarray(array), dtype=dtype, device=device)

        self.index, self.link = put(local, int), put(links, wp.vec4)
        self.start, self.entry = put(start, int), put(order, int)
        self.volume, self.mass_p = put(volume.astype(np.float32), float), put(mass_p.astype(np.float32), float)
        self.mass = put(mass[self.place].astype(np.float32), float)
        self.gravity = wp.vec3(*gravity)
        self.stress = wp.zeros(self.count, dtype=wp.mat33, device=device)
        self.push = wp.zeros(self.count, dtype=wp.vec3, device=device)
        self.clock = wp.zeros(2, dtype=int, device=device)
        self.trouble = put(np.array([NEVER, 0]), int)
        self.kernels = particle_kernels(self.terms)
        rate = wave_speed / grid.spacing
        self.stiffness = ANCHOR_STIFFNESS * rate**2
        self.damping = 2 * ANCHOR_DAMPING * np.sqrt(self.stiffness)

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
        """Frames `first` to `last` of the drive, from state `begin` (u, v over active nodes; rest if None).

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

    # Parts

    def displaced(self, u: np.ndarray) -> np.ndarray:
        """Full-grid nodal displacement [m], (..., N, 3), extended to nodes just outside the body."""
        full = np.zeros((*u.shape[:-2], self.grid.count, 3))
        full[..., self.place, :] = u
        return self.grid.extended(full, self.active)

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
        anchors.stiffness, anchors.damping, anchors.step = float(self.stiffness), float(self.damping), drive.step
        return anchors

    def _reset(self, step: int) -> None:
        self.clock.assign(np.array([0, step], np.int32))
        self.trouble.assign(np.array([NEVER, 0], np.int32))

    def _particles(self, kernel, theta, anchors, slots, u, v, rest):
        common = [self.clock, self.index, self.link, self.volume, self.mass_p, theta, anchors, slots, u, v]
        return wp.launch(kernel, self.count, common + rest, device=self.device, record_cmd=True)

    def _commands(self, theta, anchors, dt, slots, u, v):
        nodes = [self.clock, self.start, self.entry, self.link, self.stress, self.push, self.mass, self.gravity]
        return [
            self._particles(self.kernels.step, theta, anchors, slots, u, v, [self.stress, self.push, self.trouble]),
            wp.launch(node_step, len(self.place), [*nodes, dt, slots, u, v], device=self.device, record_cmd=True),
            wp.launch(tick, 1, [self.clock, 1], device=self.device, record_cmd=True),
        ]

    def _adjoint_commands(self, theta, anchors, dt, slots, u, v, ub, vb, theta_bar):
        fb, xb, sb = (wp.zeros(n, dtype=wp.vec3, device=self.device) for n in (len(self.place), self.count, self.count))
        Fb, Gb = (wp.zeros(self.count, dtype=wp.mat33, device=self.device) for _ in range(2))
        launch = {"device": self.device, "record_cmd": True}
        return [
            wp.launch(tick, 1, [self.clock, -1], **launch),
            wp.launch(node_adjoint_before, len(self.place), [self.mass, dt, ub, vb, fb], **launch),
            self._particles(self.kernels.adjoint, theta, anchors, slots, u, v, [fb, Fb, Gb, xb, sb, theta_bar]),
            wp.launch(
                node_adjoint_after,
                len(self.place),
                [self.start, self.entry, self.link, Fb, Gb, xb, sb, ub, vb],
                **launch,
            ),
        ]

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
