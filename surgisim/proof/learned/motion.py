"""Optical flow of DIS and RAFT: how far a pixel ends from where it began when it goes there and back, over some frames.

A flow that says that nothing moves comes back exactly: so does what the pictures have in common, and, where a second
view came with the recording, whether both views tell the same. A point of the left view lies in the same row of the
right one, its disparity farther left, before and after: what the two flows disagree by is an error of theirs, in rows
of the flows alone, in columns of the given depth too.
"""

import time
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.given import Given
from surgisim.perception.flow import carry, pixel_grid, round_trip
from surgisim.perception.optical_flow import Flow
from surgisim.perception.optical_flow.dis import dense_flow
from surgisim.perception.tracking.between import sample
from surgisim.perception.tracking.correspond import widen
from surgisim.perception.tracking.warp import flat_light, follow_surface, likeness

SPANS, STARTS = (1, 5, 10, 20), 4
"""Frames from one to the other, and how many pairs of each span, spread over the clip."""
FOLLOWED = (20, 40)
"""Frames through which the surface is followed, there and back."""
MARGIN = 0.02
"""Around instruments nothing is counted [longest side]."""


def flows(raft: Flow) -> dict[str, Flow]:
    """DIS on frames as they are, and as correspondence asks it, without the lamp; RAFT on frames."""
    return {
        "dis": dense_flow,
        "dis_flat_light": lambda a, b: dense_flow(flat_light(a), flat_light(b)),
        "raft": raft,
    }


def measured(
    rgb: np.ndarray, tool: np.ndarray, given: Given, camera: Camera, ways: dict[str, Flow], said: Callable[[str], None]
) -> dict[str, dict[str, Any]]:
    """Way -> span -> numbers; tissue away from instruments counts."""
    shown = ~np.stack([widen(mask, round(MARGIN * max(mask.shape))) for mask in tool])
    result: dict[str, dict[str, Any]] = {name: {} for name in ways}
    for span in (s for s in SPANS if s < len(rgb)):
        starts = np.unique(np.linspace(0, len(rgb) - 1 - span, STARTS).round().astype(int))
        for name, flow in ways.items():
            rows = [_pair(rgb, shown, given, camera, flow, t, t + span) for t in starts]
            result[name][str(span)] = {k: round(float(np.mean([r[k] for r in rows])), 4) for k in rows[0]}
            said(f"{name}, {span} frames: {result[name][str(span)]}")
    return result


def _pair(rgb, shown, given: Given, camera: Camera, flow: Flow, a: int, b: int) -> dict[str, float]:
    begun = time.perf_counter()
    there = flow(rgb[a], rgb[b])
    seconds = time.perf_counter() - begun
    back = flow(rgb[b], rgb[a])
    grid = pixel_grid(*shown.shape[1:])
    counted = shown[a] & _inside(grid + there) & (carry(shown[b].astype(np.float32), there) > 0.99)
    loop = round_trip(there, back)[counted]
    alike = likeness(flat_light(rgb[a]), carry(flat_light(rgb[b]), there), counted)[counted]
    row = {
        "back_mean": loop.mean(),
        "back_median": np.median(loop),
        "back_over_1px": (loop > 1).mean(),
        "alike": alike.mean(),
        "moved": np.linalg.norm(there, axis=-1)[counted].mean(),
        "seconds": seconds,
    }
    if len(given.right) and len(given.depth) and given.baseline:
        row |= _both_views(there, flow(given.right[a], given.right[b]), given, camera, counted, a, b)
    return row


def _both_views(left, right, given: Given, camera: Camera, counted: np.ndarray, a: int, b: int) -> dict[str, float]:
    """What the flows of both views disagree by, rows and columns [px]."""
    grid = pixel_grid(*counted.shape)
    before, after = (camera.fx * given.baseline / np.where(z > 0, z, np.nan) for z in (given.depth[a], given.depth[b]))
    beside = np.stack([grid[..., 0] - np.nan_to_num(before), grid[..., 1]], -1)
    apart = left - sample(right, beside)
    x, y = (np.rint(grid + left).astype(int)[..., k].clip(0, counted.shape[1 - k] - 1) for k in (0, 1))
    apart[..., 0] -= before - after[y, x]
    usable = counted & _inside(beside) & np.isfinite(apart).all(-1)
    return {"views_rows": abs(apart[usable, 1]).mean(), "views_columns": abs(apart[usable, 0]).mean()}


def _inside(at: np.ndarray) -> np.ndarray:
    height, width = at.shape[:2]
    return (at >= 0).all(-1) & (at[..., 0] <= width - 1) & (at[..., 1] <= height - 1)


def followed(rgb: np.ndarray, tool: np.ndarray, raft: Flow, said: Callable[[str], None]) -> dict[str, dict[str, Any]]:
    """Span -> the surface followed there and back, by DIS alone and with RAFT from the first frame, and what differs
    where both see it."""
    hidden = np.stack([widen(mask, round(MARGIN * max(mask.shape))) for mask in tool])
    kept: dict[bytes, np.ndarray] = {}

    def once(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        key = cv2.imencode(".png", np.hstack([a, b]))[1].tobytes()
        if key not in kept:
            kept[key] = raft(a, b)
        return kept[key]

    result: dict[str, dict[str, Any]] = {}
    for span in (s for s in FOLLOWED if s < len(rgb)):
        found = {}
        for name, far in (("dis", None), ("raft", once)):
            begun = time.perf_counter()
            *_, there = follow_surface(rgb[: span + 1], hidden[: span + 1], far=far)
            seconds = (time.perf_counter() - begun) / span
            *_, back = follow_surface(rgb[span::-1], hidden[span::-1], far=far)
            off = np.linalg.norm(sample(back.position, there.position) - pixel_grid(*tool.shape[1:]), axis=-1)
            returns = there.seen & (sample(back.seen.astype(np.float32), there.position) > 0.99)
            found[name] = (off, returns, seconds)
        common = found["dis"][1] & found["raft"][1]
        result[str(span)] = {
            name: {
                "seen_both_ways": round(float(returns[~hidden[0]].mean()), 4),
                "back_mean": round(float(off[common].mean()), 4),
                "back_median": round(float(np.median(off[common])), 4),
                "seconds_a_frame": round(seconds, 2),
            }
            for name, (off, returns, seconds) in found.items()
        }
        said(f"followed {span} frames: {result[str(span)]}")
    return result
