"""Several runs of one body at once: on a GPU a small body leaves most of the card idle.

The copies lie side by side in one grid, a whole number of cells apart, so that each hangs on its nodes as the body
itself does; nothing passes between them. Parameters and drives may differ from copy to copy.
"""

from dataclasses import replace

import numpy as np

from surgisim.mpm.grid import Grid
from surgisim.mpm.grip import Drive
from surgisim.mpm.setup import Prepared
from surgisim.mpm.simulator import Breakdown, Run, Simulator
from surgisim.problem import Problem

ANCHORS = 31
"""That one run can have: the bits of an int."""
GAP = 6
"""Cells between two copies' grids, more than what follows a body reaches (extension.py)."""


class Batch:
    """`copies` of a prepared body."""

    def __init__(self, prepared: Prepared, copies: int) -> None:
        """Raises Problem where the body is cut, or has another form than the total one."""
        one = prepared.simulator
        if not isinstance(one, Simulator) or one.cut is not None:
            raise Problem("batch: only whole bodies in the total form run side by side. Run them one after the other.")
        self.one, self.copies = one, copies
        self.apart = int(one.grid.shape[0]) + GAP
        self.shift = np.array([self.apart * one.grid.spacing, 0.0, 0.0])
        grid = Grid(one.grid.origin, np.array([self.apart * copies, *one.grid.shape[1:]]), one.grid.spacing)
        moves = np.arange(copies)[:, None] * self.shift
        balls = tuple(replace(ball, center=ball.center + move) for move in moves for ball in one.kinks.balls)
        self.all = Simulator(
            rest=(one.rest + moves[:, None]).reshape(-1, 3), volume=np.tile(one.volume_p, copies),
            density=one.density, grid=grid, terms=one.terms, gravity=tuple(one.gravity), device=one.device,
            precision=one.precision, balls=balls, threads=one.threads,
        )  # fmt: skip
        self.at = self._nodes()

    def run(self, thetas: list[np.ndarray], drives: list[Drive], *, last: int | None = None) -> list[Run | Breakdown]:
        """A run for each theta, (P, M), and drive; a Breakdown in the place of one that cannot go on.

        The drives have one step and one number of frames. Raises Problem where they have not.
        """
        if len({(d.step, d.steps, d.per_frame) for d in drives}) > 1:
            raise Problem("batch: runs at once need one step and one number of frames. Give all the smallest step.")
        results: list[Run | Breakdown] = []
        size = min(self.copies, ANCHORS // len(drives[0].path))
        for k in range(0, len(drives), size):
            results += self._at_once(thetas[k : k + size], drives[k : k + size], last)
        return results

    def _at_once(self, thetas: list[np.ndarray], drives: list[Drive], last: int | None) -> list[Run | Breakdown]:
        count = len(drives)
        # Copies without a task stand still.
        idle = [replace(drives[0], member=np.zeros_like(drives[0].member))] * (self.copies - count)
        theta = np.concatenate([*thetas, *[thetas[0]] * (self.copies - count)])
        try:
            run = self.all.run(theta, self._stacked(drives, idle), last=last)
        except Breakdown:
            return [self._alone(t, d, last) for t, d in zip(thetas, drives, strict=True)]
        q = run.q.reshape(len(run.q), self.copies, self.one.count, -1)
        return [Run(run.u[:, self.at[k]], run.v[:, self.at[k]], q[:, k]) for k in range(count)]

    def _alone(self, theta: np.ndarray, drive: Drive, last: int | None) -> Run | Breakdown:
        try:
            return self.one.run(theta, drive, last=last)
        except Breakdown as breakdown:
            return breakdown

    def _stacked(self, drives: list[Drive], idle: list[Drive]) -> Drive:
        """One drive for all copies: the anchors of the first, of the second, and so on."""
        each = len(drives[0].path)
        turning = [d.turn for d in drives]
        turn = None
        if any(t is not None for t in turning):
            still = np.broadcast_to(np.eye(3), (each, drives[0].steps + 1, 3, 3))
            turn = np.concatenate([still if t is None else t for t in turning])
        return replace(
            drives[0],
            member=np.concatenate([d.member << (k * each) for k, d in enumerate(drives)] + [d.member for d in idle]),
            share=np.concatenate([d.share for d in drives + idle]),
            path=np.concatenate([d.path for d in drives]),
            hold=np.concatenate([d.hold for d in drives]),
            stiffness=np.concatenate([d.stiffness for d in drives]),
            center=np.concatenate([d.center + k * self.shift for k, d in enumerate(drives)]),
            turn=turn,
        )

    def _nodes(self) -> np.ndarray:
        """Where the nodes of the body itself lie among those of each copy, (copies, A)."""
        plain, shape = self.one.rule.shape[1], self.one.grid.shape
        where = np.stack(np.unravel_index(self.one.place[:plain], shape))
        row = np.full(self.all.grid.count, -1)
        row[self.all.place[: self.all.rule.shape[1]]] = np.arange(self.all.rule.shape[1])
        at = []
        for k in range(self.copies):
            moved = np.ravel_multi_index(where + np.array([[k * self.apart], [0], [0]]), self.all.grid.shape)
            kinks = self.all.rule.shape[1] + self.one.kinks.count * k + np.arange(self.one.kinks.count)
            at.append(np.concatenate([row[moved], kinks]))
        return np.array(at)
