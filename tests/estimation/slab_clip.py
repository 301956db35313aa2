"""A clip of a pulled slab, as the stages before an estimation would hand it over."""

import numpy as np
from slab import pulled, slab

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.scene import Scene
from surgisim.artifacts.tracks import Tracks
from surgisim.estimation import fit
from surgisim.estimation.doubts import none
from surgisim.mpm.setup import prepare

FPS, T = 25.0, 24
CAMERA = Camera(64, 48, 80.0, 80.0, 31.5, 23.5, FPS, T, "known", "given", "slab", [64, 48], [0, 0, 64, 48])
TRUE = {"corotated": {"E": 900.0, "nu": 0.38}, "newtonian": {"eta": 1.2}}
QUICK = {"field_iterations": 0, "image_weight": 0.0, "iterations": 5}


def silent(*_):
    pass


def alone(monkeypatch) -> None:
    """A fit without what else there might be, a finer grid and what is left open: half of its time."""
    monkeypatch.setattr(fit, "_weighed", lambda trial, solution, *_: (trial, solution, {}, []))
    monkeypatch.setattr(fit, "finely", lambda trial, solution, *_: (trial, solution))
    monkeypatch.setattr(fit, "doubts", lambda trial, x, spreads, beside, tracks, camera: none(tracks))


RUNS: dict[str, tuple[np.ndarray, np.ndarray]] = {}
"""Of planted slabs, by what was planted: the surface's points and where they go, (K, T, 3) [m]."""


def clip(values=TRUE, motion=None, noise=3e-5, stiff=None, deep=0.015, seed=0, places=None, spacing=0.003):
    """What the stages before would hand over, made with `values` on a grid of `spacing` [m] and then forgotten.

    deep: from where on the tissue is held [m].
    """
    body, motion = slab(), motion or pulled(frames=T, hold=9)
    key = repr((values, motion.position.tobytes(), motion.active.tobytes(), stiff, deep, places, spacing))
    if key not in RUNS:
        RUNS[key] = _moved(body, motion, values, stiff, deep, places, spacing)
    points, xyz = (part.copy() for part in RUNS[key])
    rng = np.random.default_rng(seed)
    xyz = xyz + np.where(np.arange(T)[:, None] > 0, rng.normal(0, noise, xyz.shape), 0.0)
    k = xyz.shape[:2]
    tracks = Tracks(
        CAMERA.project(xyz).astype(np.float32), np.ones(k, bool), np.full(k, 0.1, np.float32), xyz.astype(np.float32),
        np.full((*k, 2), max(noise, 1e-5), np.float32),
    )  # fmt: skip
    split = np.zeros(T, np.uint8)
    split[1::8], split[-3:] = 1, 2
    rgb = np.zeros((T, 48, 64, 3), np.uint8)
    some = np.zeros((T, 48, 64), bool)
    g = len(points)
    scene = Scene(points, np.zeros(g), np.full((g, 3), -6.5), np.tile([1.0, 0, 0, 0], (g, 1)), np.full((g, 3), 0.5))
    return body, scene, tracks, motion, Frames(rgb, split), Masks(some, ~some, some, np.ones(T, np.float32)), CAMERA


def _moved(body, motion, values, stiff, deep, places, spacing) -> tuple[np.ndarray, np.ndarray]:
    fine = slab(spacing=spacing)
    made = prepare(fine, tuple(values), density=1050.0, places=places, grips=motion)
    theta, held = made.theta(values), fine.rest[:, 2] > 0.06 + deep
    if stiff is not None:
        theta[:, 0] *= stiff(fine.rest)
    per_frame = 2 * made.per_frame(
        {**values, "corotated": {"E": theta[:, 0].max(), "nu": values["corotated"]["nu"]}}, FPS
    )
    run = made.simulator.run(theta, made.drive(motion, values, fps=FPS, per_frame=per_frame, held=held, firm=False))
    points = body.rest[body.surface].astype(float)
    carry = made.simulator.carry(points)
    return points, np.stack([points + carry @ u.astype(float) for u in run.u], 1)
