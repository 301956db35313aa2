"""Instruments and tissue points that move as they are told: masks, flow and tracks without pictures."""

from dataclasses import dataclass

import cv2
import numpy as np

H, W = 96, 128


@dataclass(frozen=True)
class Pull:
    """One bar from `entry` to a tip that stands at `tip` and is carried by `way` [px], (T, 2)."""

    entry: tuple[float, float]
    tip: tuple[float, float]
    way: np.ndarray
    holds: np.ndarray
    """(T,) bool."""


def course(frames: int, begin: int, stop: int, by: tuple[float, float]) -> np.ndarray:
    """A way that goes evenly from 0 at `begin` to `by` at `stop`, (T, 2)."""
    share = np.clip((np.arange(frames) - begin) / (stop - begin), 0, 1)
    return share[:, None] * np.array(by)


def pulled(pulls: list[Pull], *, reach: float = 18.0, breath: np.ndarray | None = None):
    """tool (T, H, W), flow (T - 1, H, W, 2), tracks xy (K, T, 2), seen (K, T): tissue carried while it is held."""
    frames = len(pulls[0].way)
    x, y = np.meshgrid(np.arange(3.0, W, 4.0), np.arange(3.0, H, 4.0))
    start = np.stack([x.ravel(), y.ravel()], -1)
    moved = np.zeros((len(start), frames, 2))
    tool = np.zeros((frames, H, W), bool)
    flow = np.zeros((frames - 1, H, W, 2), np.float32)
    for pull in pulls:
        weight = np.exp(-((np.linalg.norm(start - pull.tip, axis=-1) / reach) ** 2))
        held = np.flatnonzero(pull.holds)
        carried = np.zeros_like(pull.way)
        if len(held):
            carried[held[0] :] = pull.way[held[0] :] - pull.way[held[0]]
            gone = np.arange(frames - held[-1] - 1)
            carried[held[-1] + 1 :] = carried[held[-1]] * np.exp(-1.0 - gone)[:, None]
        moved += weight[:, None, None] * carried
        for t in range(frames):
            bar = _bar(pull, t)
            tool[t] |= bar
            if t + 1 < frames:
                flow[t][bar] = pull.way[t + 1] - pull.way[t]
    xy = start[:, None] + moved + (0 if breath is None else breath)
    at = np.clip(np.rint(xy).astype(int), 0, [W - 1, H - 1])
    hidden = np.stack([_wide(m) for m in tool])
    seen = ~hidden[np.arange(frames), at[..., 1], at[..., 0]]
    return tool, flow, xy, seen


def _bar(pull: Pull, t: int) -> np.ndarray:
    mask = np.zeros((H, W), np.uint8)
    tip = np.rint(np.array(pull.tip) + pull.way[t]).astype(int)
    cv2.line(mask, tip.tolist(), [round(v) for v in pull.entry], 1, 7)
    return mask > 0


def _wide(mask: np.ndarray) -> np.ndarray:
    return cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
