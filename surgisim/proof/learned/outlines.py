"""Masks of colour_motion and of SAM 2, with one click on each instrument, beside masks that came with a recording.

Masks that come with recordings are drawn wider than instruments are. Beside the plain overlap, the found masks are
widened by as many pixels as fit the given mask of the clicked frame best, and that frame is not counted.
"""

import time
from collections.abc import Callable, Sequence
from typing import Any

import cv2
import numpy as np

from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.config.masking import Masking
from surgisim.perception.masking import colour_motion, sam2
from surgisim.perception.tracking.correspond import widen

WIDEST = 0.08
"""Most that masks are widened by [longest side]."""
SHOWN = 6
"""Frames in a picture."""
COLOURS = {"given": (255, 255, 255), "colour_motion": (255, 210, 0), "sam2": (0, 230, 255)}
METHODS: dict[str, Callable] = {"colour_motion": colour_motion.tool, "sam2": sam2.tool}


def masks(frames: Frames, given: Given, settings: Masking) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Masks of each method, (T, H, W) bool, and what is told of them.

    settings: with clicks in one frame, and SAM 2's files.
    """
    found, told = {}, {}
    for name, tool in METHODS.items():
        begun = time.perf_counter()
        found[name], _ = tool(frames, given, settings, lambda *_: None)
        seconds = (time.perf_counter() - begun) / len(frames.rgb)
        told[name] = {"seconds_a_frame": round(seconds, 2)}
        if len(given.tool):
            told[name] |= beside(found[name], given.tool, settings.clicks[0].frame)
    told["overlap_of_the_two"] = summary(overlaps(found["colour_motion"], found["sam2"]))
    return found, told


def beside(found: np.ndarray, given: np.ndarray, clicked: int) -> dict[str, Any]:
    """Overlap with given masks, as found and widened as the clicked frame asks."""
    reach = range(round(WIDEST * max(given.shape[1:])) + 1)
    by = max(reach, key=lambda r: overlaps(widen(found[clicked], r)[None], given[clicked][None])[0])
    others = np.arange(len(found)) != clicked
    wide = np.stack([widen(mask, by) for mask in found])
    inside = (found & given).sum((1, 2)) / np.maximum(found.sum((1, 2)), 1)
    return {
        "overlap": summary(overlaps(found, given)),
        "inside_given": summary(inside),
        "widened_by": by,
        "overlap_widened": summary(overlaps(wide, given)[others]),
    }


def overlaps(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Intersection over union in each frame, 1 where both are empty, (T,)."""
    union = (a | b).sum((1, 2))
    return np.where(union > 0, (a & b).sum((1, 2)) / np.maximum(union, 1), 1.0)


def summary(values: np.ndarray) -> dict[str, float | int]:
    return {"mean": round(float(values.mean()), 3), "min": round(float(values.min()), 3), "at": int(values.argmin())}


def picture(rgb: np.ndarray, shown: dict[str, np.ndarray], clicks: Sequence, *, scale: int = 2) -> np.ndarray:
    """Frames spread over the clip in two rows, with the outline of each mask; a cross where it was clicked."""
    tiles = []
    chosen = sorted({*np.linspace(0, len(rgb) - 1, SHOWN).round().astype(int).tolist()})
    marked = clicks[0].frame if clicks else -1
    if marked not in chosen and marked >= 0:
        chosen[int(np.argmin([abs(t - marked) for t in chosen]))] = marked
    for t in chosen:
        tile = cv2.resize(rgb[t], None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
        for name, mask in shown.items():
            large = cv2.resize(mask[t].astype(np.uint8), tile.shape[1::-1], interpolation=cv2.INTER_NEAREST)
            edges, _ = cv2.findContours(large, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
            cv2.drawContours(tile, edges, -1, COLOURS[name], 2)
        for click in (c for c in clicks if c.frame == t):
            at = round(scale * click.x), round(scale * click.y)
            cv2.drawMarker(tile, at, (255, 0, 255), cv2.MARKER_CROSS, 24, 3)
        cv2.putText(tile, f"frame {t}", (8, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.7, (255, 255, 255), 2)
        tiles.append(tile)
    row = len(tiles) // 2
    return np.vstack([np.hstack(tiles[:row]), np.hstack(tiles[row : 2 * row])])
