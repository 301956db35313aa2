"""A small block of tissue whose recording the engine itself makes, with a law planted or none."""

import hashlib
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from surgisim.artifacts.motion import Motion
from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis.base import SAFETY, carried, values_of
from surgisim.diagnosis.clip import clip_of
from surgisim.diagnosis.context import Case
from surgisim.diagnosis.diagnose import prepare_case
from surgisim.diagnosis.hypothesis import ease
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.noise import Noise
from surgisim.physics.place import Place
from surgisim.recordings.mesh import Mesh
from surgisim.recordings.recording import Recording

SIZE, FPS, FRAMES, FIT = np.array([0.036, 0.030, 0.012]), 20.0, 32, 24
SLOWLY = 10.0
"""Frames a second at which weak effects show: at FPS half as many steps are run, and inertia hides them."""
GRID = 0.23
TRUE = np.array([np.log(2.5e3), 0.44, np.log(4e-3)])
NOISE = dict(
    shared=0.3, length=0.006, rigid=0.02, tilt=0.02, keep_shared=0.6, keep_rigid=0.5, lasting=0.2, keep=0.6, white=0.45
)


def block() -> Mesh:
    corner = (np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) - [0.5, 0.5, 0]) * SIZE
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [(a, *pair) for a, b, c, d in sides for pair in ((b, c), (c, d))]
    return Mesh(corner, np.array(faces))


def recording(values=None, places=None, seed=0, sigma=1.5e-4, fps=FPS, late=0.0, share=GRID) -> Recording:
    """Pulled up and sideways from frame 4, held, let go at 17; `values` and `places` are what is planted.

    late: how many frames after the last active one the grip opens; share: of the grid that it is recorded on.
    """
    rng = np.random.default_rng(seed)
    side = np.stack(np.meshgrid(np.linspace(-0.016, 0.016, 8), np.linspace(-0.013, 0.013, 6)), -1).reshape(-1, 2)
    rest = np.concatenate([side, np.full((len(side), 1), SIZE[2])], 1)
    time = np.arange(FRAMES)
    path = ease((time - 4) / 5)[:, None] * [0.002, 0.001, 0.004]
    center = np.array([-0.006, -0.004, SIZE[2]])
    motion = Motion(
        center[None], np.array([0.005]), (center + path)[None], ((time >= 4) & (time <= 17))[None], np.ones(1), "given"
    )
    held = np.array([[[-0.1, -0.1, -1.0], [0.1, 0.1, 0.0025]]])
    made = Recording(
        name="planted", fps=fps, mesh=block(), boxes=held,
        points=np.repeat(rest[:, None], FRAMES, 1).astype(np.float32),
        visible=np.ones((len(rest), FRAMES), bool), sigma=np.full(len(rest), sigma), motion=motion, density=1050.0,
        gravity=(0.0, 0.0, -9.81), place=rest, split={"fit": (0, FIT), "held_out": (FIT, FRAMES)},
    )  # fmt: skip
    clip = clip_of(made, share=share)
    values = {**values_of(TRUE), **(values or {})}
    prepared = clip.prepared(tuple(values))
    theta = prepared.theta(values, places or {})
    per_frame = prepared.per_frame_of(prepared.stiffest(theta), fps, SAFETY)
    drive = prepared.drive(
        motion, values, fps=fps, per_frame=per_frame, places=places or {}, late=np.full((1, FRAMES), late)
    )
    moved = carried(prepared.simulator.carry(rest), prepared.simulator.run(theta, drive))
    noise = Noise(level=np.full(len(rest), sigma), **NOISE).draw(rest, FRAMES, rng)
    points = rest[:, None] + moved + noise + 0.5 * sigma * rng.standard_normal((len(rest), 1, 3))
    return Recording(**{**vars(made), "points": points.astype(np.float32)})


BLOB = Place((0.008, 0.006, 0.010), 0.0035)
TILT = {"gravity": {"x": 8.0, "y": 0.0, "z": 0.0, "onset": -1.0}}
"""Weight along x, from the first frame on [m/s^2]."""
RUNS: Path | None = None
"""Where runs are kept; conftest.py sets it."""


def edged(made: Recording) -> Recording:
    """As a video's, in which the edge of what is seen goes along with the pull at four places, by .3 of it."""
    pull = made.motion.position - made.motion.center_rest[:, None]
    corners = np.array([[x, y, SIZE[2]] for x in (-0.014, 0.014) for y in (-0.011, 0.011)])
    rim = corners[:, None] + 0.3 * pull * made.motion.active[..., None]
    doubts = {"held.depth": 1e-5 * np.ones((*made.visible.shape, 3))}
    return replace(made, doubts=doubts, motion=replace(made.motion, rim=rim, rim_radius=np.full(4, 0.004)))


def memo_of(made: Recording) -> Memo:
    """Runs of a recording are made once, whichever test wants them."""
    return Memo(RUNS, hashlib.sha256(made.points.tobytes()).hexdigest())


def case_of(made: Recording, **settings) -> Case:
    """Noise, base and nuisances of a recording."""
    chosen = Diagnosing(**{"grid": GRID, "nulls": 8, **settings})
    return prepare_case(clip_of(made, share=chosen.grid), chosen, memo_of(made), lambda *_: None)


@cache
def plain() -> Case:
    """Of a recording in which nothing is planted."""
    return case_of(recording())


@cache
def tilted() -> Case:
    """Of one whose weight lies along x."""
    return case_of(recording(values=TILT))
