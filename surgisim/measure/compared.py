"""A replay's displacements beside those of a reference, of a still body and of one that goes as the grip does."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.motion import Motion
from surgisim.measure.carried import carried
from surgisim.measure.reference import Reference
from surgisim.measure.run import Run

MOVING = 0.25
"""A point counts as moving if it ever goes this share of the liveliest points' way (95th percentile)."""
OF_MOVING = f"points that move at least {MOVING:.0%} of the liveliest ones' way"


@dataclass(frozen=True)
class Compared:
    """Displacements since frame 0 in the reference's lengths [m], (K, T, 3), and in the picture [px], (K, T, 2)."""

    wanted: np.ndarray
    wanted_px: np.ndarray
    ours: np.ndarray
    """NaN where the body has no such point."""
    ours_px: np.ndarray
    rigid: np.ndarray
    """As the nearest grip that holds; back in its place without one."""
    rigid_px: np.ndarray
    counted: np.ndarray
    """Point-frames with both, frame 0 and what is carried along the edge as it is seen to go left out, (K, T) bool."""
    on_body: np.ndarray
    """(K,) bool."""
    lively: np.ndarray
    """Points that move, (K, 1) bool."""


def compared(run: Run, to: Reference) -> Compared:
    path = carried(run.replay, run.body, to.rest)
    on_body = np.isfinite(path).all((1, 2))
    pixels = np.where(on_body[:, None, None], run.camera.project(np.where(np.isfinite(path), path, 1.0)), np.nan)
    wanted, wanted_px = from_start(to.xyz), from_start(to.xy)
    counted = to.visible & on_body[:, None] & np.isfinite(wanted).all(-1)
    counted[:, 0] = False
    counted[run.motion.on_rim(np.where(np.isfinite(to.rest), to.rest, np.inf))] = False
    lively = moving(from_start(to.way), counted, on_body)
    rigid = with_grip(to.motion, to.xyz[:, 0].astype(float))
    return Compared(
        wanted, wanted_px, to.scale * from_start(path), from_start(pixels), rigid, _in_picture(rigid, to), counted,
        on_body, lively,
    )  # fmt: skip


def moving(wanted: np.ndarray, counted: np.ndarray, among: np.ndarray) -> np.ndarray:
    """Points that move, (K, 1) bool: displacements (K, T, D), which of them count (K, T), of which points (K,)."""
    far = np.where(counted, np.linalg.norm(np.where(counted[..., None], wanted, 0), axis=-1), 0).max(1, initial=0)
    return (far >= MOVING * np.percentile(far[among], 95))[:, None] if among.any() else among[:, None]


def with_grip(motion: Motion, rest: np.ndarray) -> np.ndarray:
    """Displacement of points at rest (K, 3) that went as the grip does which holds nearest to them [m], (K, T, 3)."""
    moved = np.zeros((len(rest), motion.active.shape[1], 3))
    if not len(motion.radius):
        return moved
    known = np.where(np.isfinite(rest), rest, 0.0)
    away = np.linalg.norm(known[:, None] - motion.center_rest, axis=-1) - motion.radius
    for t in np.flatnonzero(motion.active.any(0)):
        nearest = np.where(motion.active[:, t], away, np.inf).argmin(1)
        moved[:, t] = (motion.position[:, t] - motion.center_rest)[nearest]
    return moved


def from_start(path: np.ndarray) -> np.ndarray:
    """Displacement since frame 0 of paths (K, T, D)."""
    return path.astype(np.float64) - path[:, :1]


def _in_picture(moved: np.ndarray, to: Reference) -> np.ndarray:
    start = to.xyz[:, :1].astype(float)
    seen = [to.focal * place[..., :2] / place[..., 2:] for place in (start + moved, start)]
    return seen[0] - seen[1]
