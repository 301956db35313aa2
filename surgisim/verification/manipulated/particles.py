"""A scene moved by the material point engine."""

from collections.abc import Callable

import numpy as np

from surgisim.artifacts.body import Body
from surgisim.artifacts.motion import Motion
from surgisim.mpm.setup import Prepared, Values, prepare
from surgisim.verification.manipulated.scene import DENSITY, FINE, FPS, Scene

TERMS = ("neo_hookean_ciarlet", "newtonian")


def follow(
    scene: Scene,
    spacing: float,
    probes: np.ndarray,
    progress: Callable[[float, float, str], None] | None = None,
    frames: int | None = None,
) -> np.ndarray:
    """Displacement [m] of surface points `probes` (u, v) [m], (K, 2), at `scene.clock()`, (T, K, 3).

    spacing: of the grid [m]; frames: stop after so many.
    """
    made, values = prepared(scene, spacing, probes)
    per = made.per_frame(values, FPS * FINE)
    path = made.drive(motion(scene, frames), values, fps=FPS * FINE, per_frame=per)
    run = made.simulator.run(made.theta(values), path, progress=progress)
    carry = made.simulator.carry(scene.shape.upper(probes))
    return np.stack([carry @ u.astype(float) for u in run.u])


def prepared(scene: Scene, spacing: float, probes: np.ndarray) -> tuple[Prepared, Values]:
    law = scene.law
    values = {TERMS[0]: {"E": law.E, "nu": law.nu}, TERMS[1]: {"eta": law.eta}}
    made = prepare(body(scene, spacing), TERMS, density=DENSITY, carried=scene.shape.upper(probes), grips=motion(scene))
    return made, values


def body(scene: Scene, spacing: float) -> Body:
    """The block as columns of particles, 8 a cell; the last layer, of half the thickness, lies on the base and is held.

    A held particle is pinned where it is, so the plane that does not move runs through the held layer's centres.
    """
    shape, step = scene.shape, spacing / 2
    count = np.rint((shape.high - shape.low) / step).astype(int)
    axes = [a + (np.arange(n) + 0.5) * (b - a) / n for a, b, n in zip(shape.low, shape.high, count, strict=True)]
    uv = np.stack(np.meshgrid(*axes), -1).reshape(-1, 2)
    top = -shape.relief(uv)
    whole = np.maximum(np.rint((shape.thickness - top) / step - 0.5).astype(int), 1)
    thick = (shape.thickness - top) / (whole + 0.5)
    owner = np.repeat(np.arange(len(uv)), whole + 1)
    layer = np.arange(len(owner)) - np.repeat(np.cumsum(whole + 1) - whole - 1, whole + 1)
    held = layer == whole[owner]
    local = np.concatenate([uv[owner], (top[owner] + (layer + 0.5) * thick[owner])[:, None]], 1)
    area = float(np.prod((shape.high - shape.low) / count))
    rest = shape.place(local)
    return Body(
        rest=rest.astype(np.float32),
        volume=(thick[owner] * area * np.where(held, 0.5, 1.0)).astype(np.float32),
        color=np.full(rest.shape, 0.5, np.float32),
        surface=layer == 0,
        held=held,
        spacing=spacing,
    )


def motion(scene: Scene, frames: int | None = None, fine: int = FINE) -> Motion:
    """Both grips at `fine` instants a frame, for `frames` frames or the whole scene."""
    frames = scene.frames if frames is None else frames
    clock = np.arange((frames - 1) * fine + 1) / fine
    center = np.stack([scene.shape.upper(h.grip.uv) for h in scene.holds])
    position = np.stack([c + h.path(clock) for c, h in zip(center, scene.holds, strict=True)])
    active = np.stack([(clock > h.begin - 1e-9) & (clock < h.release + 1e-9) for h in scene.holds])
    radius = np.array([h.grip.radius for h in scene.holds])
    return Motion(center, radius, position, active, np.ones(2), "given")
