"""A manipulation by hand: the body at rest, taken hold of, carried where somebody drags it, cut and let go.

Frame after frame it is told where each grip is wanted and whether it holds. What was done is kept, and comes out as an
operation (docs/operations.md), which the simulation stage repeats.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import warp as wp
from scipy.interpolate import PchipInterpolator

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.material import Material
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.physics import Physics
from surgisim.gaussians.rim import beyond
from surgisim.mpm.cut import Cut
from surgisim.mpm.setup import checked_per_frame, theta_of
from surgisim.mpm.simulator import Simulator, State
from surgisim.physics.catalogue import choose
from surgisim.problem import Problem
from surgisim.simulation.operation import GRIP, Plan
from surgisim.simulation.setup import bodies, boundary, held_at_rim
from surgisim.viewer.case import Case

FASTEST = 0.5
"""How far a grip goes in a frame at most, however fast somebody drags [grid spacing]."""


MOST_STEPS = 256
"""Most steps between two states that are shown on a GPU, so that 100,000 particles are seen over 30 times a
second (an H200 showed 23.3 frames of 389 steps a second)."""


@dataclass(frozen=True)
class Grasp:
    center: tuple[float, float, float]
    """Of the ball of tissue that is held, at rest, camera frame [m]."""
    radius: float
    """[m]"""


class Manipulation:
    """One run by hand. Frames are the clip's: 1 / fps of tissue's time each."""

    def __init__(
        self,
        case: Case,
        grasps: tuple[Grasp, ...],
        cut: Cut | None = None,
        *,
        physics: tuple[Physics, Material] | None = None,
        device: str = "cpu",
    ) -> None:
        """physics: the fitted ones if None. Raises Problem for a grasp outside of the body."""
        self.grasps, self.cut, self.camera = grasps, cut, case.camera
        law, material = physics or (case.physics, case.material)
        if law.form != "total":
            raise Problem("view: the paper's updated form has no run by hand. Fit with estimation.form: total.")
        _refuse_clocks(law)
        task = held_at_rim(Plan(_still(grasps), np.zeros((2, 3)), cut, 0), case.motion)
        made = bodies(case.body, [case.scene, beyond(case.scene, case.camera)], law, task, device)
        self.theta, self.simulator = theta_of(law, material), made[0].simulator
        self._opened = made[1].simulator if cut is not None else None
        per_frame = checked_per_frame(law, material, case.camera.fps)
        self._drive = boundary(made[0], task, law, material, case.camera, per_frame)
        parts = math.ceil(per_frame / MOST_STEPS) if wp.get_device(device).is_cuda else 1
        self._ends = np.linspace(0, per_frame, parts + 1).round().astype(int).tolist()
        self._fastest = FASTEST * case.body.spacing
        self.reset()

    def reset(self) -> None:
        """Back to rest; nothing is kept."""
        self.frame, self.cut_frame = 0, None
        self._offsets, self._holds = [np.zeros((len(self.grasps), 3))], [np.ones(len(self.grasps), bool)]
        self._now: Simulator = self.simulator
        self._course: list[tuple[np.ndarray, np.ndarray]] = []
        self._run = self._played(None)
        self.state, self.displacement = next(self._run)

    @property
    def count(self) -> int:
        """Parts of a frame."""
        return len(self._ends) - 1

    @property
    def active(self) -> Simulator:
        """The body as it is now: whole, or cut."""
        return self._now

    @property
    def offsets(self) -> np.ndarray:
        """Where each grip is at the frame that was last simulated, past its place at rest [m], (J, 3)."""
        return self._offsets[self.frame]

    def advance(self, wanted: np.ndarray, holds: np.ndarray) -> State:
        """One frame on: grips go toward `wanted`, displacements [m], (J, 3), and hold where `holds`, (J,) bool.

        A grip that has let go does not take hold again. The body lags one frame behind, so that a grip's way through
        a frame is the smooth one that a replay of the same frames takes.
        """
        for _ in self.parts(wanted, holds):
            pass
        return self.state

    def parts(self, wanted: np.ndarray, holds: np.ndarray) -> Iterator[State]:
        """The same in parts of a frame that take no longer than somebody who watches should wait; take them all."""
        last = self._offsets[-1]
        step = np.asarray(wanted, float).reshape(-1, 3) - last
        length = np.linalg.norm(step, axis=1, keepdims=True)
        self._offsets.append(last + step * np.minimum(1.0, self._fastest / np.maximum(length, 1e-12)))
        self._holds.append(self._holds[-1] & np.asarray(holds, bool))
        if len(self._offsets) < 3:
            return
        path, hold = self._way(self.frame)
        for first, end in pairwise(self._ends):
            self._course.append((path[:, first : end + 1], hold[:, first:end]))
            self.state, self.displacement = next(self._run)
            if end == self._drive.per_frame:
                self.frame += 1
            yield self.state

    def sever(self) -> None:
        """Cut now, along the line that was given; a second time does nothing. Raises Problem where none was given."""
        if self._opened is None:
            raise Problem("view: no cut was placed. Place one, and start anew.")
        if self.cut_frame is None:
            u, v, q = self.state
            begin = (*(self._opened.inherited(self.simulator, a) for a in (u, v)), q)
            self._now, self.cut_frame = self._opened, self.frame
            self._run = self._played(begin)
            self.state, self.displacement = next(self._run)

    def operation(self, name: str = "by hand") -> dict:
        """What was done, for `--operation`. Raises Problem before the first frame."""
        if self.frame < 1:
            raise Problem("view: nothing was done yet, so there is nothing to export. Start, drag, and export then.")
        fps, frames = self.camera.fps, len(self._offsets)
        do: list[dict] = []
        for j, grasp in enumerate(self.grasps):
            path = [[k / fps, *map(float, self._offsets[k][j])] for k in range(frames)]
            held = [k for k in range(frames) if self._holds[k][j]]
            let_go = {} if held[-1] == frames - 1 else {"until": max(held[-1], 1) / fps}
            do.append({"act": "carry", "at": list(grasp.center), "path": path, "radius": grasp.radius, **let_go})
        if self.cut_frame is not None:
            line = [list(map(float, self.cut.begin)), list(map(float, self.cut.end))]
            do.append({"act": "cut", "along": line, "depth": float(self.cut.depth), "time": self.cut_frame / fps})
        return {"name": name, "seconds": (frames - 1) / fps, "do": do}

    def _played(self, begin: State | None) -> Iterator[tuple[State, wp.array]]:
        return self._now.play_along(self.theta, self._drive, self._taken(), begin=begin)

    def _taken(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        while True:
            yield self._course.pop()

    def _way(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """The anchors' path and hold from frame k to the next, of which the one after is known too."""
        per, first = self._drive.per_frame, max(k - 1, 0)
        path, hold = self._drive.path.copy(), self._drive.hold.copy()
        grips = slice(1, 1 + len(self.grasps))
        if self.grasps:
            knots = np.array(self._offsets[first : k + 3])
            way = PchipInterpolator(np.arange(len(knots)), knots)(k - first + np.arange(per + 1) / per)
            path[grips] = np.moveaxis(way, 1, 0)
            hold[grips] = (self._holds[k] & self._holds[k + 1])[:, None]
        return path, hold


def _refuse_clocks(law: Physics) -> None:
    """Raise Problem for a law that acts by the recording's clock: by hand there is none."""
    terms = choose(tuple(law.terms))
    timed = [
        name
        for name, term in terms.items()
        if "phase" in term.params or (not term.memory and any(p.unit == "s" for p in term.params.values()))
    ]
    if timed:
        raise Problem(
            f"view: {', '.join(timed)} acts at times of the recording, which a run by hand does not have. Choose the "
            "body 'fitted', or repeat an exported operation by command."
        )


def checked_device(device: str) -> str:
    """Raise Problem for a device that is none, or that this machine lacks."""
    if device not in ("cpu", "cuda"):
        raise Problem(f"--device is '{device}'; cpu or cuda is wanted.")
    if device == "cuda" and not wp.is_cuda_available():
        raise Problem("--device cuda: this machine has no CUDA device that Warp finds. Take cpu.")
    return device


def _still(grasps: tuple[Grasp, ...]) -> Motion:
    """Two frames in which every grip holds where it is."""
    center = np.array([g.center for g in grasps], float).reshape(-1, 3)
    return Motion(
        center_rest=center,
        radius=np.array([g.radius for g in grasps], float),
        position=np.repeat(center[:, None], 2, 1),
        active=np.ones((len(grasps), 2), bool),
        confidence=np.ones(len(grasps)),
        source="given",
    )


def under(
    case: Case, origin: np.ndarray, direction: np.ndarray, positions: np.ndarray | None = None
) -> np.ndarray | None:
    """Index of the seen particle that a ray from `origin` along `direction`, camera frame [m], (3,) each, meets first.

    positions: where the particles are now [m], (P, 3); at rest if None. None where it misses all by over a cell.
    """
    at = (case.body.rest if positions is None else positions).astype(float)
    way = np.asarray(direction, float) / np.linalg.norm(direction)
    arm = at - np.asarray(origin, float)
    along = arm @ way
    beside = np.linalg.norm(arm - along[:, None] * way, axis=1)
    near = np.flatnonzero((beside < 0.5 * case.body.spacing) & (along > 0))
    if not len(near):
        near = np.flatnonzero((beside < case.body.spacing) & (along > 0))
    return None if not len(near) else int(near[along[near].argmin()])


def default_radius(case: Case) -> float:
    """Of a grip that says none [m]."""
    return GRIP * case.body.spacing


def pixel_of(camera: Camera, point: np.ndarray) -> np.ndarray:
    """Where a point, camera frame [m], (3,), is seen in the recording's own pixels, (2,)."""
    return camera.to_recording(camera.project(np.asarray(point, float)))
