"""Read the light that tissue sends back along its tracks, for `brightness.py` to compare simulations with."""

import cv2
import numpy as np

from surgisim.artifacts.masks import Masks
from surgisim.estimation.brightness import Brightness, carry_of, tangents_of
from surgisim.lighting.headlight import linear_light
from surgisim.lighting.veil import ABOVE, veil_of
from surgisim.mpm.simulator import Simulator
from surgisim.perception.tracking.between import sample
from surgisim.perception.tracking.correspond import widen

SHAPE, FLOOR = 0.3, 0.02
"""Spread of the simulation's own error, as a share of the change nearby, and its least value."""
NOISE = 0.03
"""Least spread of log brightness along a point's way, highlights' skirts included."""
BLUR = 0.01
"""Over how far light is averaged, as a share of the longer image side."""
MARGIN = 0.012
"""How far around an instrument light is not believed, as a share of the longer image side."""
STILL, MOVING, ENOUGH = 0.05, 0.1, 10
"""Shares of the farthest way below which a point stands still, and above which it moves; how many of either there must
be."""
REACH = 0.3
"""Length scale of the simulation's error, as a share of how far the motion spreads."""


def brightness(
    rgb: np.ndarray,
    spoilt: np.ndarray,
    rest: np.ndarray,
    xy: np.ndarray,
    visible: np.ndarray,
    course: np.ndarray,
    simulator: Simulator,
    *,
    step: float,
    independent: float,
) -> Brightness | None:
    """The light of tracked points; None where too few of them move, or stand still, in sight.

    rgb: sRGB, (T, H, W, 3) uint8. spoilt: instrument, its surroundings and highlights, (T, H, W) bool. rest: the
    points in frame 0, camera frame [m], (K, 3). xy: where they are seen [px], (K, T, 2), visible: whether, (K, T) bool;
    a frame in which none is visible is left aside.
    course: share of the pull in every frame, (T,). step: over how far a surface's turning is taken [m].
    """
    light, clear = _read(rgb, spoilt, xy, veil_of(rgb, spoilt))
    known = visible & clear & visible[:, :1] & clear[:, :1]
    change = np.where(known, light - light[:, :1], 0.0)
    far = np.linalg.norm(np.where(visible[..., None], xy - xy[:, :1], 0.0), axis=-1)
    still = known & (far < STILL * np.percentile(far.max(1), 99))
    moving = (far * known).max(1) > MOVING * np.percentile(far.max(1), 99)
    used = visible.any(0)
    if still[:, used].sum(0).min() < ENOUGH or moving.sum() < ENOUGH:
        return None
    # Exposure and lamp: what still tissue does in a frame is no motion.
    gain = np.array([np.median(change[still[:, t], t]) if used[t] else 0.0 for t in range(len(used))])
    change = np.where(known, change - gain, 0.0)
    noise = np.hypot(NOISE, 1.4826 * np.median(np.abs(change[still])))
    tangents = tangents_of(rest)[moving]
    rest, far, known, change = rest[moving], far[moving].max(1), known[moving], change[moving]
    modes = _modes(rest, far, course, change, known)
    carry = carry_of(simulator, rest, tangents, step)
    supported = (np.abs(simulator.support(carry).reshape(len(rest), 5) - 1) < 0.05).all(1)
    weight = np.where(known & supported[:, None], 1 / noise, 0.0)
    return Brightness(rest, tangents, change, weight, modes, course, step, independent, carry)


def spoilt(masks: Masks) -> np.ndarray:
    """Pixels whose light is not the tissue's own: instrument and highlights with what they touch, (T, H, W) bool."""
    by = max(round(MARGIN * max(masks.tool.shape[1:])), 1)
    return np.stack([widen(t, by) | widen(s, 1) for t, s in zip(masks.tool, masks.specular, strict=True)])


def _read(rgb: np.ndarray, spoilt: np.ndarray, xy: np.ndarray, grey: float) -> tuple[np.ndarray, np.ndarray]:
    """Log of the linear light around points without a veil's, and whether nothing spoils it, (K, T) each."""
    width = max(BLUR * max(rgb.shape[1:3]), 0.7)
    light, clear = np.empty(xy.shape[:2]), np.empty(xy.shape[:2], bool)
    for t, frame in enumerate(rgb):
        usable = (~spoilt[t] & (frame.max(-1) < 250) & (frame.max(-1) > 8)).astype(np.float32)
        share = cv2.GaussianBlur(usable, (0, 0), width)
        mean = cv2.GaussianBlur(linear_light(frame).mean(-1) * usable, (0, 0), width) / np.maximum(share, 1e-3) - grey
        at = xy[:, t, None].astype(np.float32)
        light[:, t] = np.log(np.maximum(sample(mean, at)[:, 0], 1e-4))
        clear[:, t] = (sample(share, at)[:, 0] > 0.8) & (sample(mean, at)[:, 0] >= ABOVE * grey)
    return light, clear


def _modes(rest: np.ndarray, far: np.ndarray, course: np.ndarray, change: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Smooth fields that the error of the simulated shape may make, times their spread at a full pull, (K, Q)."""
    along = known * np.abs(course)
    size = np.sqrt((along * change**2).sum(1) / np.maximum(along.sum(1), 1e-9)) / max(np.abs(course).max(), 1e-9)
    middle = np.average(rest, axis=0, weights=far**2)
    reach = REACH * np.sqrt(np.average(((rest - middle) ** 2).sum(1), weights=far**2))
    apart = np.linalg.norm(rest[:, None] - rest[None], axis=-1)
    likeness = np.exp(-0.5 * (apart / reach) ** 2)
    around = np.sqrt((likeness @ (size**2 * known.any(1))) / np.maximum(likeness @ known.any(1), 1e-9))
    value, vector = np.linalg.eigh(likeness)
    chosen = value > 1e-2 * value[-1]
    return np.maximum(SHAPE * around, FLOOR)[:, None] * vector[:, chosen] * np.sqrt(value[chosen])
