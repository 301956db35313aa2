"""A body of points moved through its world: implicit steps, grips, supports, and what pushes points from outside.

Steps are those of the second backward difference formula, which damps slow swinging hardly at all and fast at once:

    v = (3 x - 4 x' + x'') / 2 dt,  a = (3 v - 4 v' + v'') / 2 dt,  M a = f(x, v)

Each is solved by iterations with the matrix at rest, accelerated as Anderson (1965) does; nothing is linear in `f`.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from surgisim.phantom.families.hidden import Hidden
from surgisim.phantom.families.world import Grip, World
from surgisim.phantom.timeline import ease
from surgisim.problem import Problem

LONGEST = 0.016
"""Of steps [s]."""
CLOSE = 2e-7
"""Where iterations end: largest change of a place [m]."""
ITERATIONS = 80
MEMORY = 7
"""Iterations that Anderson's acceleration looks back on."""
FIRM = 75.0
"""Stiffness of a grip that holds by springs, over E times its radius [1]."""
RIM = 0.3
"""Share of its way that the rim of a pad loses [1]."""
STUCK = 1e-3
"""A base that may slide sticks by springs as stiff as tissue of this thickness [m]."""


class Points(Protocol):
    """What a solver moves."""

    rest: np.ndarray
    """[m], (N, 3)."""
    mass: np.ndarray
    """[kg], (N,)."""
    held: np.ndarray
    """(N,) bool."""

    def push(self, x: np.ndarray, v: np.ndarray, t: float, dt: float, keep: bool) -> np.ndarray:
        """Forces from inside [N], (N, 3), at places x [m], velocities v [m/s] and the end t [s] of a step dt [s].

        keep: whether what the tissue remembers goes on from here.
        """

    def tangent(self) -> tuple[sparse.spmatrix, sparse.spmatrix]:
        """Stiffness [N/m] and damping [N s/m] at rest, (3 N, 3 N)."""

    def read(self, x: np.ndarray) -> np.ndarray:
        """Displacement of the probes [m], (K, 3)."""


@dataclass
class Taken:
    """Points that a grip has, and where they were when it closed."""

    points: np.ndarray
    found: np.ndarray
    share: np.ndarray
    spring: np.ndarray | None


class Outside(Protocol):
    """What acts on points from outside."""

    def push(self, x: np.ndarray, t: float, force: np.ndarray, keep: bool) -> None:
        """Add to `force` [N]."""


def move(points: Points, world: World, hidden: tuple[Hidden, ...]) -> np.ndarray:
    """Paths of the probes [m], (K, T, 3). Raises Problem where a step has no solution."""
    by_name = {h.name: h for h in hidden if h.magnitude}
    body = _Moving(points, world, by_name)
    paths = [np.zeros_like(world.rest)]
    for t in range(1, world.frames):
        body.frame(t)
        paths.append(points.read(body.x[0]))
    return world.rest[:, None] + np.stack(paths, 1)


class _Moving:
    def __init__(self, points: Points, world: World, hidden: dict[str, Hidden]) -> None:
        self.points, self.world, self.hidden = points, world, hidden
        frame = 1 / world.fps
        self.steps = math.ceil(frame / LONGEST)
        self.dt = frame / self.steps
        still = np.zeros_like(points.rest)
        self.x = [points.rest.copy(), points.rest.copy()]
        self.v = [still, still]
        self.taken: dict[int, Taken] = {}
        self.outside = [make(points, world, hidden[name]) for name, make in OUTSIDE.items() if name in hidden]
        self.base = _support(points, world, hidden)
        stiff, damping = points.tangent()
        mass = sparse.diags(np.repeat(points.mass, 3))
        self.matrix = (2.25 / self.dt**2 * mass + 1.5 / self.dt * damping + stiff).tocsr()
        for each in self.outside:
            if isinstance(each, _Base):
                self.matrix = self.matrix + sparse.diags(each.diagonal.ravel())
        self.solves: dict[tuple, tuple] = {}

    def frame(self, t: int) -> None:
        for s in range(1, self.steps + 1):
            self._step(t - 1 + s / self.steps)

    def _step(self, at: float) -> None:
        """To a time in frames."""
        points, world, dt = self.points, self.world, self.dt
        now = at / world.fps
        (x1, x2), (v1, v2) = self.x, self.v
        active = tuple(j for j, grip in enumerate(world.grips) if grip.holds(at))
        for j in active:
            if j not in self.taken:
                self.taken[j] = _taken(points, world, world.grips[j], x1)
        fixed, goal = self.base.fixed.copy(), points.rest + self.base.shift(now)
        for j in active:
            mine = self.taken[j]
            if mine.spring is None:
                fixed[mine.points] = True
                goal[mine.points] = _goal(mine, world, j, at, self.hidden)
        free, lu = self._solver(active, fixed)
        x = np.where(fixed, goal, 2 * x1 - x2 if at > 1 else x1)

        def residual(x: np.ndarray, keep: bool = False) -> np.ndarray:
            v = (3 * x - 4 * x1 + x2) / (2 * dt)
            force = points.push(x, v, now, dt, keep)
            for each in self.outside:
                each.push(x, now, force, keep)
            for j in active:
                mine = self.taken[j]
                if mine.spring is not None:
                    pull = _goal(mine, world, j, at, self.hidden) - x[mine.points]
                    force[mine.points] += mine.spring[:, None] * pull
            return force - points.mass[:, None] * (3 * v - 4 * v1 + v2) / (2 * dt)

        changes: list[np.ndarray] = []
        places: list[np.ndarray] = []
        for _ in range(ITERATIONS):
            r = residual(x).ravel()[free]
            if not np.isfinite(r).all():
                raise Problem(f"phantom: the body tears at {now:.3f} s. Hide less, or pull less far.")
            change = lu.solve(r)
            changes.append(change)
            places.append(x.ravel()[free])
            step = _anderson(places[-MEMORY:], changes[-MEMORY:])
            flat = x.ravel().copy()
            flat[free] = step
            x = flat.reshape(x.shape)
            if np.abs(change).max() < CLOSE:
                break
        else:
            raise Problem(f"phantom: no balance is found at {now:.3f} s. Hide less, or pull less far.")
        residual(x, keep=True)
        v = (3 * x - 4 * x1 + x2) / (2 * dt)
        self.x, self.v = [x, x1], [v, v1]

    def _solver(self, active: tuple[int, ...], fixed: np.ndarray):
        if active not in self.solves:
            free = np.flatnonzero(~fixed.ravel())
            matrix = self.matrix
            for j in active:
                if self.taken[j].spring is not None:
                    more = np.zeros_like(self.points.rest)
                    more[self.taken[j].points] = self.taken[j].spring[:, None]
                    matrix = matrix + sparse.diags(more.ravel())
            # Symmetric and positive: pivots off the diagonal would only fill it.
            whole = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
            self.solves[active] = free, splu(matrix[free][:, free].tocsc(), **whole)
        return self.solves[active]


def _anderson(places: list[np.ndarray], changes: list[np.ndarray]) -> np.ndarray:
    """The next place from those before and the changes that were proposed there."""
    if len(places) == 1:
        return places[0] + changes[0]
    off = np.stack([changes[-1] - c for c in changes[:-1]], 1)
    moved = np.stack([places[-1] - p for p in places[:-1]], 1)
    weight = np.linalg.lstsq(off, changes[-1], rcond=1e-10)[0]
    return places[-1] + changes[-1] - (moved + off) @ weight


def _taken(points: Points, world: World, grip: Grip, x: np.ndarray) -> Taken:
    away = np.linalg.norm(points.rest - grip.center, axis=1)
    mine = np.flatnonzero((away <= grip.radius * (1 + 1e-9)) & ~points.held)
    if len(mine) < 4:
        mine = np.argsort(away + 1e3 * points.held)[:4]
    share = np.ones(len(mine)) if grip.handling != "pads" else 1 - RIM * np.minimum(away[mine] / grip.radius, 1) ** 2
    spring = None
    if grip.handling == "springs":
        spring = FIRM * world.material.E * grip.radius * points.mass[mine] / points.mass[mine].sum()
    return Taken(mine, x[mine].copy(), share[:, None], spring)


def _goal(mine: Taken, world: World, j: int, at: float, hidden: dict[str, Hidden]) -> np.ndarray:
    """Where a grip carries its points [m] at a time in frames."""
    path = world.grips[j].path(at)
    slip = hidden.get("tool_slip")
    if slip is not None and j == 0:
        # It ratchets: with each jerk a share of what is left.
        jerks = slip.numbers["jerks"]
        each = 1 - (1 - slip.magnitude) ** (1 / len(jerks))
        path = path * math.prod(1 - each * float(ease((at / world.fps - jerk) / 0.08)) for jerk in jerks)
    return mine.found + mine.share * path


@dataclass(frozen=True)
class _Still:
    fixed: np.ndarray
    """(N, 3) bool."""
    shift: Callable[[float], np.ndarray]
    """Of what is fixed [m], at a time [s]; (3,) or 0."""


def _support(points: Points, world: World, hidden: dict[str, Hidden]) -> _Still:
    fixed = np.repeat(points.held[:, None], 3, 1)
    breath = hidden.get("respiration")
    if breath is not None:
        turn, skew = 2 * np.pi * breath.numbers["frequency"], breath.numbers["skew"]
        way, phase = np.array(breath.numbers["direction"]), breath.numbers["phase"]

        def wave(t: float) -> float:
            return math.sin(turn * t + phase + skew * math.sin(turn * t + phase))

        return _Still(fixed, lambda t: breath.magnitude * (wave(t) - wave(0.0)) * float(ease(t / 0.4)) * way)
    if "sliding_base" in hidden:
        fixed[points.held] = _normal(world) > 0.5
    return _Still(fixed, lambda t: np.zeros(3))


def _normal(world: World) -> np.ndarray:
    """Of the plane that is held, (3,): 1 along it, 0 else."""
    box = world.body.boxes[0]
    return np.eye(3)[np.argmin(np.subtract(box["max"], box["min"]))]


def _area(world: World, points: Points) -> np.ndarray:
    """Of the held side at each point [m^2], (N,): shared out by mass."""
    body = world.body
    faces = body.skin[body.held[body.skin].all(1)]
    a, b, c = np.moveaxis(body.points[faces], 1, 0)
    whole = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    share = points.mass * points.held
    return whole * share / share.sum()


def _patch(points: Points, hidden: Hidden) -> tuple[np.ndarray, np.ndarray]:
    """Points near its place that are not held, and their shares, of sum 1."""
    share = hidden.share(points.rest) * points.mass * ~points.held
    mine = np.flatnonzero(share > 1e-3 * share.max())
    return mine, share[mine] / share[mine].sum()


class _Base:
    """A base that sticks by springs, which slide along where friction no longer holds them."""

    def __init__(self, points: Points, world: World, hidden: Hidden) -> None:
        self.mine = np.flatnonzero(points.held)
        self.rest = points.rest[self.mine]
        area = _area(world, points)[self.mine]
        self.stiff = world.material.E * area / STUCK
        self.most = world.material.E / hidden.magnitude * area
        self.along = 1 - _normal(world)
        self.slid = np.zeros_like(self.rest)
        self.diagonal = np.zeros_like(points.rest)
        self.diagonal[self.mine] = self.stiff[:, None] * self.along

    def push(self, x, t, force, keep):
        pull = self.stiff[:, None] * self.along * (self.rest + self.slid - x[self.mine])
        size = np.linalg.norm(pull, axis=1)
        share = np.where(size > self.most, self.most / np.maximum(size, 1e-30), 1.0)[:, None]
        force[self.mine] += share * pull
        if keep:
            self.slid -= (1 - share) * pull / self.stiff[:, None]


class _Tether:
    def __init__(self, points: Points, world: World, hidden: Hidden) -> None:
        self.mine, share = _patch(points, hidden)
        self.stiff = hidden.magnitude * world.material.E * hidden.extent * share
        self.feet = points.rest[self.mine] + np.array(hidden.numbers["foot"]) - hidden.center
        self.long = np.linalg.norm(self.feet - points.rest[self.mine], axis=1) + hidden.numbers["slack"]

    def push(self, x, t, force, keep):
        away = self.feet - x[self.mine]
        length = np.linalg.norm(away, axis=1)
        force[self.mine] += (self.stiff * np.maximum(length - self.long, 0) / length)[:, None] * away


class _Contact:
    """Something blunt comes, presses for as long as it stays, and goes."""

    def __init__(self, points: Points, world: World, hidden: Hidden) -> None:
        self.mine, self.share = _patch(points, hidden)
        self.force = hidden.magnitude * world.material.E * hidden.extent**2 * np.array(hidden.numbers["direction"])
        self.onset, self.end, self.rise = hidden.onset, hidden.end, hidden.numbers["rise"]

    def push(self, x, t, force, keep):
        amount = float(ease((t - self.onset) / self.rise) * ease((self.end - t) / self.rise))
        force[self.mine] += amount * self.share[:, None] * self.force


class _Second:
    """A second instrument, never seen, draws farther and farther, by springs."""

    def __init__(self, points: Points, world: World, hidden: Hidden) -> None:
        self.mine, share = _patch(points, hidden)
        self.rest = points.rest[self.mine]
        self.stiff = 6 * world.material.E * hidden.extent * share
        self.speed = 1e-3 * hidden.magnitude * hidden.numbers["rate"] * np.array(hidden.numbers["direction"])
        self.onset = hidden.onset

    def push(self, x, t, force, keep):
        since = max(t - self.onset, 0.0)
        if since:
            goal = self.rest + since * self.speed
            force[self.mine] += min(since / 0.1, 1.0) * self.stiff[:, None] * (goal - x[self.mine])


OUTSIDE: dict[str, Callable[..., Outside]] = {
    "tether": _Tether, "hidden_contact": _Contact, "second_grip": _Second, "sliding_base": _Base,
}  # fmt: skip
"""What acts on points from outside, the same for every solver."""
