"""Runs of one body: forward, and back through every step.

Memory of a backward run: one state a frame, plus the states of one stretch of steps. A stretch is computed again
before it is walked back, so an adjoint costs one extra forward however long the clip; a frame too long for the
memory allowed is walked in several stretches.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from copy import copy
from dataclasses import dataclass, replace
from threading import Lock
from typing import Any, Self

import numpy as np
import warp as wp

from surgisim.mpm.by_cell import ByCell
from surgisim.mpm.by_particle import ByParticle
from surgisim.mpm.culprit import culprit
from surgisim.mpm.grid import Grid
from surgisim.mpm.grip import Drive
from surgisim.mpm.kernels import node_kernels, shapes, tick
from surgisim.mpm.kink import Ball
from surgisim.mpm.march import March, Phases
from surgisim.mpm.nodes import Nodes
from surgisim.mpm.stream import Stream
from surgisim.mpm.tear import Severing
from surgisim.physics.catalogue import choose, columns
from surgisim.problem import Problem

wp.config.log_level = wp.LOG_WARNING

NEVER = 2**31 - 1
LOADING = Lock()

State = tuple[np.ndarray, ...]
"""u, v over solid nodes, (A, 3) each, and, where a law has memory, q, (P, S)."""


def by_cell(device: str) -> bool:
    """Whether particles are stepped cell by cell there, as on a CPU, or each by itself."""
    return not wp.get_device(device).is_cuda


class Breakdown(Problem):
    """A run that cannot go on: inverted tissue or a number that is none, with step and place."""

    def __init__(self, message: str, particle: int | None = None) -> None:
        super().__init__(message)
        self.particle = particle
        """Which went wrong first, if it is known."""


@dataclass(frozen=True)
class Run:
    """What a forward run leaves: enough to draw it, to judge it and to walk it back."""

    u: np.ndarray
    """Nodal displacement at every frame [m], (T, A, 3), over solid nodes."""
    v: np.ndarray
    """Nodal velocity at every frame [m/s], (T, A, 3)."""
    q: np.ndarray
    """What the laws remember at every frame, (T, P, S); S is 0 where nothing is remembered."""

    def state(self, t: int) -> State:
        return self.u[t], self.v[t], self.q[t]

    def after(self, frames: int) -> "Run":
        """The same after so many more frames in its first state."""
        return Run(*(np.concatenate([np.repeat(part[:1], frames, 0), part]) for part in (self.u, self.v, self.q)))


@dataclass(frozen=True)
class Gradient:
    """Derivative of a loss with respect to everything a run starts from."""

    theta: np.ndarray
    """By the laws' columns, (P, M)."""
    path: np.ndarray
    """By the anchors' path at every step [1/m], (1 + J, S + 1, 3)."""
    hold: np.ndarray | None
    """By the share with which each anchor holds, where it does, (1 + J, S); None if not asked for."""
    stiffness: np.ndarray | None
    """By the anchors' springs [s^2], (1 + J, 3, 3); None if not asked for."""
    u: np.ndarray
    """By the first displacement [1/m], (A, 3)."""
    v: np.ndarray
    """By the first velocity [s/m], (A, 3)."""


class Simulator(Nodes):
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
        cut: Severing | None = None,
        device: str = "cpu",
        precision: str = "single",
        threads: int = 1,
        balls: tuple[Ball, ...] = (),
    ) -> None:
        """Particles `rest` [m], (P, 3), of `volume` [m^3], (P,); precision is 'single' or 'double'.

        threads: how many share a step on a CPU; results depend on their number by rounding only. balls: gripped
        tissue, at whose skin the displacement may bend.
        """
        self.rest, self.terms, self.device, self.density = np.asarray(rest, float), tuple(terms), device, float(density)
        self.count, self.volume_p, self.precision = len(rest), np.asarray(volume, float), precision
        super().__init__(grid, self.rest, self.volume_p, cut, balls)
        self.types, self.threads = shapes(precision), threads
        self.real = np.float32 if precision == "single" else np.float64
        local, links = self.rest_links
        # A kink's weights sum to nothing: its inertia is what keeps it as slow as a cell.
        inertia = grid.spacing**2 * (links[..., 1:] ** 2).sum(-1)
        self._local, self._weight = local, np.where(local < self.rule.shape[1], links[..., 0], inertia)
        self.gravity, self.stream = self.types.Vec(*gravity), Stream(device)
        with self.stream.turn():
            self._settle(local, links)

    def beside(self) -> Self:
        """The same body with device arrays of its own, for another thread."""
        other = copy(self)
        other.stream = Stream(self.device)
        with other.stream.turn():
            other._settle(*self.rest_links)
        return other

    def _settle(self, local: np.ndarray, links: np.ndarray) -> None:
        """What every run needs, on the device; local and links as of `Nodes.links`."""
        s, device = self.types, self.device
        layout = ByCell if by_cell(device) else ByParticle
        self.layout = layout(local, links, len(self.place), self.terms, self.precision, self.threads, self._put)
        self.order, self.laws = self.layout.order, self.layout.laws
        self.volume, self.rest_d = self._put(self.volume_p[self.order], s.real), self._put(self.rest[self.order], s.Vec)
        self.nodes = node_kernels(self.precision)
        self.width = self.laws.memory
        self.mass = self._put(self.node_mass(np.full(self.count, self.density)), s.real)
        self.clock = wp.zeros(2, dtype=int, device=device)
        self.trouble = self._put(np.tile([NEVER, 0], (self.layout.parts, 1)), int)
        self.force = wp.zeros((self.layout.parts, len(self.place)), dtype=s.Vec, device=device)
        if self.stream.later:
            # Where a state arrives from the device: u, v, memory and trouble.
            kinds = [(len(self.place), s.Vec)] * 2 + [(self.count if self.width else 1, self.laws.Memory)]
            self.hosts = [wp.empty(n, dtype=kind, device="cpu", pinned=True) for n, kind in kinds]
            self.hosts.append(wp.empty(self.trouble.shape, dtype=int, device="cpu", pinned=True))
        self._loaded(self.layout.kernels.step, *vars(self.nodes).values(), tick)

    def _loaded(self, *kernels: wp.Kernel) -> None:
        """Load what is about to be launched, once: two threads that load one module together crash the process."""
        with LOADING:
            for kernel in kernels:
                wp.load_module(kernel.module, device=self.device)

    def node_mass(self, density: np.ndarray) -> np.ndarray:
        """Mass of the solid nodes [kg], (A,), for a density at every particle [kg/m^3], (P,)."""
        share = self._weight * (self.volume_p * density)[:, None]
        return np.bincount(self._local.ravel(), share.ravel(), len(self.place))

    # Forward

    def run(
        self,
        theta: np.ndarray,
        drive: Drive,
        *,
        begin: State | None = None,
        first: int = 0,
        last: int | None = None,
        progress: Callable[[float, float, str], None] | None = None,
    ) -> Run:
        """Frames `first` to `last` of the drive, from state `begin` (rest if None; memory empty if not given).

        theta: the laws' columns, one row a particle, (P, M). Raises Breakdown where a particle inverts or a
        number stops being finite, naming step, particle and law.
        """
        last = drive.frames - 1 if last is None else last
        states = []
        for k, (state, _) in enumerate(self.play(theta, drive, begin=begin, first=first, last=last)):
            states.append(state)
            if progress and k:
                progress(k, last - first, f"frame {first + k}/{drive.frames - 1}")
        return Run(*(np.stack(part) for part in zip(*states, strict=True)))

    def play(
        self, theta: np.ndarray, drive: Drive, *, begin: State | None = None, first: int = 0, last: int | None = None
    ) -> Iterator[tuple[State, wp.array]]:
        """As `run`, frame by frame: the state, and the nodal displacement where it lies on the device, (A,) vec3."""
        last = drive.frames - 1 if last is None else last
        with self.stream.turn():
            task = self._task(theta, drive, 2)
            self._load(task, begin or (), first * drive.per_frame)
        state, _ = self._arrived(task, 0)
        yield state, task.u[0]
        for frame in range(first, last):
            with self.stream.turn():
                task.forward.march(drive.per_frame)
            slot = (frame + 1 - first) * drive.per_frame % 2
            before, (state, trouble) = state, self._arrived(task, slot)
            self._check(before, state, trouble, theta, drive, frame)
            yield state, task.u[slot]

    def play_along(
        self,
        theta: np.ndarray,
        drive: Drive,
        course: Iterable[tuple[np.ndarray, np.ndarray]],
        *,
        begin: State | None = None,
    ) -> Iterator[tuple[State, wp.array]]:
        """As `play`, where what the anchors do in a frame, or a part of it, is known only once that begins.

        drive: of one frame; what is held, and by which springs. course: for each part the anchors' displacement at its
        steps and after the last [m], (1 + J, S + 1, 3), and how firmly they hold in each step, 0-1, (1 + J, S); S is
        at most a frame's.
        """
        with self.stream.turn():
            task = self._task(theta, drive, 2)
            self._load(task, begin or (), 0)
        state, _ = self._arrived(task, 0)
        yield state, task.u[0]
        gone = 0
        for path, hold in course:
            steps = hold.shape[1]
            now = replace(drive, path=np.asarray(path, float), hold=np.asarray(hold, float), per_frame=steps)
            left = (0, 0), (0, drive.per_frame - steps)
            with self.stream.turn():
                task.anchors.path.assign(np.pad(now.path, (*left, (0, 0))).astype(self.real))
                task.anchors.hold.assign(np.pad(now.hold, left).astype(self.real))
                self._load(task, state, 0)
                task.forward.march(steps)
            before, (state, trouble) = state, self._arrived(task, steps % 2)
            self._check(before, state, trouble, theta, now, 0, gone)
            gone += steps
            yield state, task.u[steps % 2]

    # Backward

    def gradient(
        self,
        theta: np.ndarray,
        drive: Drive,
        run: Run,
        u_bar: np.ndarray,
        *,
        first: int = 0,
        memory_mb: float = 512.0,
        springs: bool = False,
    ) -> Gradient:
        """Derivative of a loss, given its derivative `u_bar` (T, A, 3) by `run.u`.

        memory_mb: what the states of a stretch may take; raises Problem if that is too little for one frame.
        springs: whether also by the anchors' hold and stiffness.
        """
        with self.stream.turn():
            return self._gradient(theta, drive, run, u_bar, first, self._stretch(drive.per_frame, memory_mb), springs)

    def _gradient(self, theta, drive: Drive, run: Run, u_bar: np.ndarray, first: int, stretch: int, springs: bool):
        per, task = drive.per_frame, self._task(theta, drive, stretch + 1)
        back = self._back(task, drive, springs)
        back.u[0].assign(u_bar[-1].astype(self.real))
        for frame in range(len(run.u) - 1, 0, -1):
            if back.u.numpy().any() or back.v.numpy().any() or back.q.numpy().any():
                self._walk_back(task, back, run.state(frame - 1), (first + frame - 1) * per, per, stretch)
            total = back.u.numpy().sum(0) + u_bar[frame - 1]
            if not np.isfinite(total).all():
                raise Problem(
                    f"adjoint: a derivative is not finite at frame {first + frame - 1}. "
                    "The run is unstable there: take a smaller step."
                )
            back.u.zero_()
            back.u[0].assign(total.astype(self.real))
        path, hold, stiffness, u, v = (
            a.numpy().astype(float).sum(0) for a in (back.path, back.hold, back.stiffness, back.u, back.v)
        )
        held = (hold, stiffness * self.density) if springs else (None, None)
        return Gradient(self._theta_bar(back), path, *held, u, v)

    def _walk_back(self, task: "_Task", back: "_Back", state: State, step: int, count: int, stretch: int) -> None:
        """Back over `count` steps that began at `step` in `state`."""
        starts = [state]
        self._load(task, state, step)
        for _ in range(math.ceil(count / stretch) - 1):
            task.forward.march(stretch)
            starts.append(self._arrived(task, stretch)[0])
            self._load(task, starts[-1], step + (len(starts) - 1) * stretch)
        for k in reversed(range(len(starts))):
            length = min(stretch, count - k * stretch)
            self._load(task, starts[k], step + k * stretch)
            task.forward.march(length)
            wp.launch(tick, 1, [self.clock, -1], device=self.device)
            back.commands.march(length)

    def _stretch(self, per: int, memory_mb: float) -> int:
        """Steps that are recorded at once, so that their states and the starts of the other stretches fit."""
        size = np.dtype(self.real).itemsize
        state = size * (6 * len(self.place) + self.width * self.count) / 2**20
        allowed = int(memory_mb / state)
        if per + 1 <= allowed:
            return per
        stretch = allowed // 2
        if stretch < 1 or math.ceil(per / stretch) + stretch + 1 > allowed:
            least = math.ceil(20 * (math.isqrt(per) + 2) * state) / 10
            raise Problem(
                f"adjoint: {memory_mb:g} MB hold {allowed} states, too few for the {per} steps of a frame. "
                f"Allow at least {least:.1f} MB."
            )
        return stretch

    def _theta_bar(self, back: "_Back") -> np.ndarray:
        theta_bar = self._by_particle(back.theta.numpy().astype(float))
        laws = choose(self.terms)
        heavy = [columns(laws).index(f"{n}.{laws[n].mass}") for n in self.laws.mass]
        if heavy:
            # The density acts through the nodes' mass and through forces that are proportional to it.
            through = (self._weight * back.mass.numpy()[self._local]).sum(1) * self.volume_p
            theta_bar[:, heavy] += (through + self._by_particle(back.rho.numpy()))[:, None]
        return theta_bar

    # Parts

    def _put(self, array: np.ndarray, dtype):
        kind = np.int32 if dtype is int else self.real
        return wp.array(np.ascontiguousarray(array, kind), dtype=dtype, device=self.device)

    def _zeros(self, shape, dtype):
        return wp.zeros(shape, dtype=dtype, device=self.device)

    def _task(self, theta: np.ndarray, drive: Drive, slots: int) -> "_Task":
        """Device arrays and recorded launches of one run."""
        theta = np.asarray(theta)
        if theta.shape != (self.count, self.laws.columns):
            raise Problem(f"theta is {theta.shape}, but ({self.count}, {self.laws.columns}) is wanted.")
        s, laws, anchors = self.types, choose(self.terms), self._anchors(drive)
        density = np.full(self.count, self.density)
        for name in self.laws.mass:
            density = density + theta[:, columns(laws).index(f"{name}.{laws[name].mass}")]
        if self.laws.mass:
            self.mass.assign(self.node_mass(density).astype(self.real))
        u, v = (self._zeros((slots, len(self.place)), s.Vec) for _ in range(2))
        q = self._zeros((slots, self.count if self.width else 1), self.laws.Memory)
        inputs = [
            self.volume, self._put(density[self.order], s.real), self.rest_d, self._put(theta[self.order], s.real),
            anchors, s.real(drive.step), slots, u, v, q,
        ]  # fmt: skip
        step = [
            self.clock, int(self.layout.ticks), self.mass, self.gravity, self.rule.shape[1], s.real(drive.step), slots,
            self.force, u, v,
        ]  # fmt: skip
        forward = [
            *self.layout.forward(self.clock, inputs, self.force, self.trouble),
            [wp.launch(self.nodes.step, len(self.place), step, device=self.device, record_cmd=True)],
            *self._tick(1),
        ]
        return _Task(slots, u, v, q, anchors, inputs, March(forward, self.device))

    def _tick(self, by: int) -> Phases:
        if self.layout.ticks:
            return []
        return [[wp.launch(tick, 1, [self.clock, by], device=self.device, record_cmd=True)]]

    def _back(self, task: "_Task", drive: Drive, springs: bool) -> "_Back":
        """Device arrays and recorded launches of the way back; nothing is stepped by recording them."""
        # Many bodies never go back, and this is the longest to compile.
        self._loaded(self.layout.kernels.adjoint)
        s, heavy, parts = self.types, bool(self.laws.mass), self.layout.parts
        f = self._zeros(len(self.place), s.Vec)
        u, v = (self._zeros((parts, len(self.place)), s.Vec) for _ in range(2))
        m = self._zeros(len(self.place) if heavy else 0, s.real)
        rho = self._zeros(self.count if heavy else 0, s.real)
        q = self._zeros(self.count if self.width else 1, self.laws.Memory)
        theta = self._zeros((self.count, self.laws.columns), s.real)
        path = self._zeros((parts, *drive.path.shape[:2]), s.Vec)
        hold = self._zeros((parts, *(drive.hold.shape if springs else (0, 0))), s.real)
        stiffness = self._zeros((parts, len(drive.path) if springs else 0), s.Mat)
        gravity = [self.gravity, self.rule.shape[1]]
        before = [self.clock, self.mass, *gravity, s.real(drive.step), task.slots, task.v, u, v, f, m]
        commands = [
            [wp.launch(self.nodes.before, len(self.place), before, device=self.device, record_cmd=True)],
            *self.layout.back(self.clock, task.inputs, f, u, v, [q, theta, rho, path, hold, stiffness]),
            *self._tick(-1),
        ]
        return _Back(u, v, q, theta, path, hold, stiffness, m, rho, March(commands, self.device))

    def _anchors(self, drive: Drive):
        s = self.types
        anchors = s.Anchors()
        anchors.member = self._put(drive.member[self.order], int)
        anchors.share = self._put(drive.share[self.order], s.real)
        anchors.path, anchors.hold = self._put(drive.path, s.Vec), self._put(drive.hold, s.real)
        anchors.turning = int(drive.turn is not None)
        turn = np.zeros((1, 1, 3, 3)) if drive.turn is None else drive.turn
        anchors.turn, anchors.center = self._put(turn, s.Mat), self._put(drive.center, s.Vec)
        anchors.stiffness = self._put(drive.stiffness * self.density, s.Mat)
        return anchors

    def _load(self, task: "_Task", state: State, step: int) -> None:
        """Put a state into the first slot; what it does not hold is zero."""
        for k, array in enumerate((task.u, task.v, task.q)):
            if k < len(state) and state[k].size:
                value = state[k][self.order] if array is task.q else state[k]
                array[0].assign(np.ascontiguousarray(value, self.real))
            else:
                array[0].zero_()
        self.clock.assign(np.array([0, step], np.int32))
        self.trouble.assign(np.tile(np.array([NEVER, 0], np.int32), (self.layout.parts, 1)))

    def _arrived(self, task: "_Task", slot: int) -> tuple[State, np.ndarray]:
        """The state in a slot, once it is there, and what trouble there was on the way."""
        arrays = [task.u[slot], task.v[slot], task.q[slot], self.trouble]
        if self.stream.later:
            with self.stream.turn():
                for host, array in zip(self.hosts, arrays, strict=True):
                    wp.copy(host, array)
            self.stream.wait()
            arrays = self.hosts
        u, v, q, trouble = (array.numpy().copy() for array in arrays)
        return (u, v, self._by_particle(q) if self.width else np.zeros((self.count, 0), self.real)), trouble

    def _by_particle(self, sorted_rows: np.ndarray) -> np.ndarray:
        """Rows in the device's order, in that of `rest`."""
        rows = np.empty_like(sorted_rows)
        rows[self.order] = sorted_rows
        return rows

    def _check(
        self,
        before: State,
        after: State,
        trouble: np.ndarray,
        theta: np.ndarray,
        drive: Drive,
        frame: int,
        gone: int = 0,
    ) -> None:
        """Stop where the last frame went wrong, and say where, when and by which law.

        gone: steps of the run before those of the drive.
        """
        step, sorted_particle = min(trouble.tolist())
        if step == NEVER and np.isfinite(after[0]).all():
            return
        if step == NEVER:
            raise Breakdown(
                f"simulation: a displacement is not finite between steps {gone + frame * drive.per_frame} and "
                f"{gone + (frame + 1) * drive.per_frame}. Take a smaller step."
            )
        particle = int(self.order[sorted_particle])
        count = max(0, step - frame * drive.per_frame - 1)
        with self.stream.turn():
            task = self._task(theta, drive, 2)
            self._load(task, before, frame * drive.per_frame)
            task.forward.march(count)
        law = culprit(self, theta, self._arrived(task, count % 2)[0], particle)
        where, total = np.round(self.rest[particle], 4).tolist(), gone + step
        raise Breakdown(
            f"simulation: particle {particle} at rest position {where} m turned inside out (or stopped being a "
            f"number) at step {total} ({total * drive.step:.4f} s), where {law} pushed hardest. Its load is too "
            "violent for this tissue or the step too large: take a smaller step, a gentler motion or a stiffer tissue.",
            particle,
        )


@dataclass(frozen=True)
class _Task:
    slots: int
    u: wp.array
    v: wp.array
    q: wp.array
    anchors: Any
    """Struct of arrays: what is held, and where it is carried."""
    inputs: list
    forward: March


@dataclass(frozen=True)
class _Back:
    u: wp.array
    v: wp.array
    q: wp.array
    theta: wp.array
    path: wp.array
    hold: wp.array
    stiffness: wp.array
    mass: wp.array
    rho: wp.array
    commands: March
