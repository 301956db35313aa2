"""One set-up to compare simulations with a clip in, from several threads at once."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from surgisim.artifacts.motion import Motion
from surgisim.estimation.observation import Observation
from surgisim.estimation.search import Search
from surgisim.mpm.grip import Drive
from surgisim.mpm.setup import Prepared, Values
from surgisim.mpm.simulator import Breakdown, Run

WORKERS = 2
SAFETY = 0.9
"""Share of the largest stable step that is used."""


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

    def drive(self, values: Values, *, frames: int | None = None, safety: float = SAFETY, stiffest=None) -> Drive:
        """The clip's motion at a step that is stable for `stiffest` (or `values`)."""
        body = self.bodies[0]
        rows = stiffest or body.stiffest(self.theta(values))
        per_frame = body.per_frame_of(rows, self.fps, safety)
        return self.bodies[0].drive(
            self.motion, values, fps=self.fps, per_frame=per_frame, frames=frames or self.frames, held=self.held,
            grip=self.grip,
        )  # fmt: skip

    def theta(self, values: Values) -> np.ndarray:
        """The laws' columns under this trial's boundary, (P, M)."""
        return self.bodies[0].theta(values, held=self.held)

    def run(self, x: np.ndarray, worker: int = 0, last: int | None = None) -> Run:
        """Simulate at x, up to frame `last`."""
        values = self.wanted.values(x)
        body = self.bodies[worker]
        return body.simulator.run(self.theta(values), self.drive(values), last=last)

    def residual(self, x: np.ndarray, worker: int = 0, last: int | None = None) -> np.ndarray | None:
        """Weighted misfit of the tracks on fitted frames up to `last`, flat; None where x cannot be simulated."""
        last = int(self.fitted[-1]) if last is None else last
        try:
            run = self.run(x, worker, last)
        except Breakdown:
            return None
        return self.observation.residual(run.u, self.fitted[self.fitted <= last]).ravel()


def at_once(work: Callable[[Any, int], Any], items: list[Any], workers: int = WORKERS) -> list[Any]:
    """work(item, worker) for every item, in order; each worker has its own thread and device arrays."""

    def mine(worker: int) -> list[Any]:
        return [work(item, worker) for item in items[worker::workers]]

    results: list[Any] = [None] * len(items)
    with ThreadPoolExecutor(workers) as pool:
        for worker, done in enumerate(pool.map(mine, range(workers))):
            results[worker::workers] = done
    return results
