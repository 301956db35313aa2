"""One set-up to compare simulations with a clip in, from several threads at once."""

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from threading import Lock
from typing import Any, Self

import numpy as np
from scipy.cluster.vq import kmeans2

from surgisim.artifacts.motion import Motion
from surgisim.estimation.lay import Laying
from surgisim.estimation.model_error import ModelError
from surgisim.estimation.observation import Observation
from surgisim.estimation.search import Search
from surgisim.mpm.batch import Batch
from surgisim.mpm.grip import Drive
from surgisim.mpm.setup import Prepared, Values
from surgisim.mpm.simulator import Breakdown, Run
from surgisim.physics.catalogue import choose
from surgisim.problem import Problem
from surgisim.side_by_side import threads, together

WORKERS, ABREAST = 2, 6
"""Simulations that a search runs at once on processors, and at most where a GPU steps them, most of which a body leaves
idle."""
SAFETY = 0.9
"""Share of the largest stable step that is used."""
STRIDES = (1.4, 1.2)
"""How many times that a search's runs may take, the longest first: what is beyond the stable step of tissue that is
hardly strained is kept for what is squeezed and torn, and most clips do neither."""
SAME = 0.01
"""How far, as a share of what moves, a longer step may take nodes elsewhere."""
REGIONS = 20
"""Parts of the tissue whose errors are taken to be independent of one another's."""


@dataclass(frozen=True)
class Trial:
    """Bodies (one a worker), what is searched, what drives them, and what they are compared with."""

    bodies: list[Prepared]
    wanted: Search
    motion: Motion
    observation: Observation
    held: np.ndarray
    """The boundary that does not move, (P,) bool."""
    fps: float
    frames: int
    fitted: np.ndarray
    """Frames that may be looked at."""
    grip: float = 1.0
    """How firmly instruments hold, see Physics."""
    firm: bool = True
    """Whether the boundary is known to hold there, see Prepared.drive."""
    laying: Laying | None = None
    """Where bodies come from that are laid anew as the search goes; none where `bodies` stay."""
    error: ModelError | None = None
    """What the simulation gets wrong although its numbers are right."""
    stride: float = 1.0
    """How many times SAFETY's step runs of the search take where they bear it, see STRIDES."""
    eased: float | None = None
    """Logarithm of how many times stiffer (softer, where negative) than at the search's start tissue is simulated
    whose pace nothing in the clip tells, whatever x says of it; None where x says it."""

    @property
    def workers(self) -> int:
        """Simulations that may run at once."""
        return len(self.bodies)

    def stand(self, x: np.ndarray, worker: int = 0) -> tuple["Trial", Motion]:
        """This trial with the body that x asks for, and how that is carried."""
        motion = self.wanted.motion(x, self.motion)
        motion = replace(motion, rim=self.motion.rim, rim_radius=self.motion.rim_radius)
        if self.laying is None:
            return self, motion
        body, observation = self.laying.at(self.wanted.held_from(x), motion, worker)
        bodies = [body] * len(self.bodies)
        return replace(self, bodies=bodies, observation=observation, held=body.body.held, laying=None), motion

    def depth(self, x: np.ndarray) -> float:
        """How deep the tissue is held at x [m]."""
        if self.laying:
            return self.wanted.held_from(x)
        body = self.bodies[0].body
        under = self.held & ~body.surface
        deepest = body.rest[under if under.any() else slice(None), 2]
        return float(np.median(deepest) - np.median(body.rest[body.surface, 2]))

    def settled(self, x: np.ndarray) -> Self:
        """The trial of the body and the motion at x, where nothing but the laws' numbers can change any more."""
        here, motion = self.stand(x)
        return replace(here, motion=motion, wanted=replace(self.wanted, carrying=None, depth=None), eased=None)

    def values(self, x: np.ndarray) -> Values:
        """The laws' numbers that are simulated at x."""
        if self.eased is None:
            return self.wanted.values(x)
        begin = np.where(self.wanted.paces, self.wanted.start, x)
        return self.wanted.values(self.wanted.paced(begin, self.eased))

    @property
    def differences(self) -> np.ndarray:
        """Steps by which derivatives are taken, (M,); 0 for what makes no difference."""
        idle = self.wanted.paces & (self.eased is not None)
        return np.where(idle, 0.0, self.wanted.differences)

    def per_frame(self, values: Values, *, safety: float = SAFETY, stiffest=None) -> int:
        """Steps between two frames that are stable for `stiffest` (or `values`)."""
        rows = stiffest or self.bodies[0].stiffest(self.theta(values))
        return self.bodies[0].per_frame_of(rows, self.fps, safety)

    def drive(
        self, values: Values, *, frames: int | None = None, safety: float = SAFETY, stiffest=None,
        per_frame: int | None = None, motion: Motion | None = None,
    ) -> Drive:  # fmt: skip
        """`motion` (the clip's), at a step that is stable for `stiffest` (or `values`) if `per_frame` is not given."""
        per_frame = per_frame or self.per_frame(values, safety=safety, stiffest=stiffest)
        return self.bodies[0].drive(
            motion or self.motion, values, fps=self.fps, per_frame=per_frame, frames=frames or self.frames,
            held=self.held, grip=self.grip, firm=self.firm,
        )  # fmt: skip

    def theta(self, values: Values) -> np.ndarray:
        """The laws' columns under this trial's boundary, (P, M)."""
        return self.bodies[0].theta(values, held=self.held)

    def run(self, x: np.ndarray, worker: int = 0, last: int | None = None) -> Run:
        """Simulate at x, up to frame `last`."""
        return self._run(x, worker, last)[0]

    def residual(self, x: np.ndarray, worker: int = 0, last: int | None = None) -> np.ndarray | None:
        """Weighted misfit on fitted frames up to `last`, flat, tracks first; None where x breaks down."""
        last = int(self.fitted[-1]) if last is None else last
        try:
            run, observation = self._run(x, worker, last)
        except Breakdown:
            return None
        return self.judged(run.u, observation, last)

    def of_frames(self, each: np.ndarray) -> np.ndarray:
        """What each residual's frame has of `each`, (T,), in the order of `residual`, (R,)."""
        count, light = len(self.observation.rest), self.observation.light
        tracks = np.broadcast_to(each[self.fitted][None, :, None], (count, len(self.fitted), 3)).ravel()
        return np.concatenate([tracks, np.tile(each[self.fitted], len(light.rest))]) if light else tracks

    @cached_property
    def regions(self) -> np.ndarray:
        """Which errors may go together: the part of the tissue of every residual, in their order, (R,) int."""
        rest, light = self.observation.rest, self.observation.light
        middles, of = kmeans2(rest, min(REGIONS, len(rest)), minit="++", seed=0)
        tracks = np.repeat(of, 3 * len(self.fitted))
        if light is None:
            return tracks
        near = len(middles) + np.linalg.norm(light.rest[:, None] - middles, axis=-1).argmin(1)
        return np.concatenate([tracks, np.repeat(near, len(self.fitted))])

    def judged(self, u: np.ndarray, observation: Observation, last: int) -> np.ndarray:
        """Weighted misfit of nodal displacements u [m], (T, A, 3), on fitted frames up to `last`, (R,)."""
        frames = self.fitted[self.fitted <= last]
        r = observation.residual(u, frames)
        r = (self.error.whiten(r, frames) if self.error else r).ravel()
        light = observation.light
        return np.concatenate([r, light.residual(u, frames).ravel()]) if light else r

    def _run(self, x: np.ndarray, worker: int, last: int | None) -> tuple[Run, Observation]:
        return self.strided(lambda stride: self._at_stride(stride, x, worker, last))

    def _at_stride(self, stride: float, x: np.ndarray, worker: int, last: int | None) -> tuple[Run, Observation]:
        values = self.values(x)
        here, motion = self.stand(x, worker)
        drive = here.drive(values, motion=motion, safety=SAFETY * stride)
        first = min(self.quiet, last or self.quiet)
        run = here.bodies[worker].simulator.run(here.theta(values), drive, first=first, last=last)
        return run.after(first), here.observation

    def strided(self, run: Callable[[float], Any]) -> Any:
        """run(stride) at this trial's, or at the stable step where that is too long."""
        if self.stride > 1.0:
            with suppress(Problem):
                return run(self.stride)
        return run(1.0)

    def striding(self, x: np.ndarray, last: int | None = None) -> tuple[Self, Run]:
        """This trial with the longest of STRIDES at which its run at x, up to frame `last`, is the same, and the run of
        it at the stable step; raises Breakdown where that cannot be simulated.

        With all of the fitted frames what comes after them must be borne as well.
        """
        until = last if last is not None and last < self.fitted[-1] else None

        def at(stride: float, worker: int) -> Run | Problem:
            try:
                return self._at_stride(stride, x, worker, until)[0]
            except Problem as problem:
                return problem

        def same(run: Run | Problem) -> bool:
            return isinstance(run, Run) and np.linalg.norm(run.u - stable.u) <= SAME * np.linalg.norm(stable.u)

        longest, *others = STRIDES
        stable, run = at_once(at, [1.0, longest], self.workers)
        if isinstance(stable, Problem):
            raise stable
        if same(run):
            return replace(self, stride=longest), stable
        kept = next((stride for stride in others if same(at(stride, 0))), 1.0)
        return replace(self, stride=kept), stable

    def closely(
        self, x: np.ndarray, pull: Run, last: int, within: int, worker: int = 0
    ) -> tuple[np.ndarray, Observation]:
        """Nodal displacements at x from the last frame of `pull`, which began at rest, to frame `last`, at `within`
        states a frame [m], (., A, 3), and what they are compared with."""
        values, since = self.values(x), len(pull.u) - 1
        here, motion = self.stand(x, worker)
        simulator, theta = here.bodies[worker].simulator, here.theta(values)

        def run(stride: float) -> np.ndarray:
            steps = math.ceil(here.per_frame(values, safety=SAFETY * stride) / within)
            closer = replace(here.drive(values, per_frame=within * steps, motion=motion), per_frame=steps)
            return simulator.run(theta, closer, begin=pull.state(-1), first=since * within, last=last * within).u

        return self.strided(run), here.observation

    @cached_property
    def calm(self) -> bool:
        """Whether nothing moves the tissue but what holds it."""
        laws = choose(self.bodies[0].terms).values()
        still = all(t.force is None and t.flow is None and t.drive is None and not t.wide for t in laws)
        return still and not any(self.bodies[0].simulator.gravity)

    @cached_property
    def quiet(self) -> int:
        """The frame up to which nothing moves a body that is laid for a search."""
        if self.laying is None or not self.calm or len(self.motion.rim):
            return 0
        return max(0, int(np.argmax(self.motion.active.any(0))) - 1)

    def together(self, points: list[np.ndarray], last: int | None = None) -> list[np.ndarray | None]:
        """`residual` at several x: side by side in one run on a GPU, on two threads on a CPU."""
        if self.bodies[0].simulator.device == "cpu" or self.laying:
            return at_once(lambda x, worker: self.residual(x, worker, last), points, self.workers)
        last = int(self.fitted[-1]) if last is None else last
        values = [self.values(x) for x in points]
        # One step for all: the smallest of theirs.
        most = max(self.per_frame(v) for v in values)
        motions = [self.wanted.motion(x, self.motion) for x in points]
        drives = [self.drive(v, per_frame=most, motion=m) for v, m in zip(values, motions, strict=True)]
        runs = self.batch.run([self.theta(v) for v in values], drives, last=last)
        return [None if isinstance(run, Breakdown) else self.judged(run.u, self.observation, last) for run in runs]

    @cached_property
    def batch(self) -> Batch:
        """As many bodies as parameters are usually varied at once."""
        return Batch(self.bodies[0], max(4, len(self.wanted.start)))


def workers(device: str) -> int:
    """Simulations that a search runs at once on a device."""
    return min(ABREAST, max(WORKERS, threads())) if device == "cuda" else WORKERS


def at_once(work: Callable[[Any, int], Any], items: list[Any], workers: int = WORKERS) -> list[Any]:
    """work(item, worker) for every item, in order; each worker has its own thread and device arrays."""

    waiting, turn, results = iter(enumerate(items)), Lock(), [None] * len(items)

    def mine(worker: int) -> None:
        while True:
            with turn:
                n, item = next(waiting, (None, None))
            if n is None:
                return
            results[n] = work(item, worker)

    if not together():
        mine(0)
        return results
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(mine, range(min(workers, len(items)))))
    return results
