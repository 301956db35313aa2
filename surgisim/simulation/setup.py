"""From artifacts and a task to bodies on their grids and their boundary condition."""

from dataclasses import replace

import numpy as np

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.material import Material
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.physics import Physics
from surgisim.artifacts.scene import Scene
from surgisim.mpm.grip import Drive
from surgisim.mpm.setup import SKIN, Prepared, prepare, values_of
from surgisim.simulation.operation import Plan

THREADS = 2
"""Threads of a run on a CPU; fixed, so that a replay has the same bytes on every number of cores."""


def recorded_task(motion: Motion, camera: Camera) -> Plan:
    return Plan(motion, np.zeros((camera.frames, 3)), None, 0)


def held_at_rim(task: Plan, recorded: Motion) -> Plan:
    """An operation on a body that the recording carries along its edge, which stays with the base now."""
    rim = recorded.rim[:, :1] + task.base
    return replace(task, motion=replace(task.motion, rim=rim, rim_radius=recorded.rim_radius))


def boundary(made: Prepared, task: Plan, physics: Physics, material: Material, camera: Camera, per_frame: int) -> Drive:
    """The boundary condition of a task at every step."""
    path = made.drive(
        task.motion,
        values_of(physics),
        fps=camera.fps,
        per_frame=per_frame,
        frames=len(task.base),
        held=material.held,
        grip=physics.grip,
        firm=False,
    )
    clock = np.arange(path.steps + 1) / per_frame
    path.path[0] = np.stack([np.interp(clock, np.arange(len(task.base)), task.base[:, a]) for a in range(3)], -1)
    return path


def bodies(body: Body, scenes: list[Scene], physics: Physics, task: Plan, device: str) -> list[Prepared]:
    """The whole body and, when something is cut, the cut one."""
    carried = np.concatenate([s.mean for s in scenes]).astype(float)
    make = [None] if task.cut is None else [None, task.cut]
    return [
        prepare(
            body, tuple(physics.terms), density=physics.density, gravity=tuple(physics.gravity),
            carried=carried, cut=cut, device=device, form=physics.form, threads=THREADS,
            grips=task.motion,
            skin=SKIN,
        )
        for cut in make
    ]  # fmt: skip
