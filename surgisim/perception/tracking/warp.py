"""Follow every pixel of the first frame through a recording.

From frame to frame by dense flow, and again and again straight from the first frame: each frame is pulled back
to the first by what is known so far, and the flow that remains is the drift to take out. Behind an instrument the
surface is guessed from its surroundings, until it is found again.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from surgisim.perception.flow import carry, dense_flow, pixel_grid, round_trip
from surgisim.perception.tracking.spread import spread

FORGET = 0.9
"""Share of a hidden pixel's own last motion, against its surroundings', that is kept per frame."""
RECOGNISED, LOST = 0.6, 2.0
"""Least correlation that counts as recognised; error at which a pixel no longer counts as seen [px]."""


@dataclass(frozen=True)
class Warp:
    """Where the first frame's pixels are in one frame."""

    position: np.ndarray
    """[px], (H, W, 2) float32; a guess where not seen."""
    seen: np.ndarray
    """Followed by what the frame shows, (H, W) bool."""
    error: np.ndarray
    """Standard deviation of each coordinate [px], (H, W) float32."""


def follow_surface(
    rgb: np.ndarray, hidden: np.ndarray, *, progress: Callable[[float, float, str], None] | None = None
) -> Iterator[Warp]:
    """One Warp a frame, the first being the identity.

    rgb: sRGB, (T, H, W, 3) uint8. hidden: pixels that do not show the surface, (T, H, W) bool.
    """
    grid = pixel_grid(*rgb.shape[1:3])
    grey = [flat_light(frame) for frame in rgb]
    now = Warp(grid.copy(), ~hidden[0], np.full(grid.shape[:2], 0.1, np.float32))
    yield now
    for t in range(1, len(rgb)):
        now = _advance(now, grey[0], grey[t - 1], grey[t], hidden[0], hidden[t - 1], hidden[t])
        if progress:
            progress(t, len(rgb) - 1, "following the surface")
        yield now


def flat_light(rgb: np.ndarray, *, radius: float = 5.0) -> np.ndarray:
    """Texture without the lamp: grey less its local mean, over its local contrast, (H, W) uint8."""
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY).astype(np.float32)
    rest = grey - cv2.GaussianBlur(grey, (0, 0), radius)
    contrast = np.sqrt(cv2.GaussianBlur(rest * rest, (0, 0), radius))
    return np.rint(np.clip(128 + 42 * rest / (contrast + 2.0), 0, 255)).astype(np.uint8)


def likeness(a: np.ndarray, b: np.ndarray, weight: np.ndarray, *, radius: float = 3.0) -> np.ndarray:
    """Correlation of two grey images around each pixel, over pixels of `weight` (H, W), from -1 to 1."""
    a, b, w = (x.astype(np.float32) for x in (a, b, weight))

    def mean(x: np.ndarray) -> np.ndarray:
        return cv2.GaussianBlur(w * x, (0, 0), radius) / total

    total = cv2.GaussianBlur(w, (0, 0), radius) + 1e-3
    ma, mb = mean(a), mean(b)
    va, vb = mean(a * a) - ma * ma, mean(b * b) - mb * mb
    return (mean(a * b) - ma * mb) / np.sqrt(np.maximum(va, 1.0) * np.maximum(vb, 1.0))


def _advance(before: Warp, first, last, new, hidden_first, hidden_last, hidden_new) -> Warp:
    grid = pixel_grid(*first.shape)
    guess, chained, step_error = _chain(before, last, new, hidden_last, hidden_new)
    position, anchored, anchor_error, like = _anchor(guess, first, new, hidden_first, hidden_new, before)
    strange = 1.5 * np.clip(RECOGNISED - like, 0.0, 1.0)
    error = np.where(anchored, anchor_error, np.sqrt(before.error**2 + step_error**2 + strange**2))
    seen = (anchored | chained) & _shown(position, hidden_new) & ~hidden_first & (error < LOST)
    # What is not seen goes with its surroundings; its own last motion is forgotten little by little.
    moved = position - grid
    around = spread(moved, seen)
    kept = around + FORGET * (guess - grid - around)
    position = grid + np.where(seen[..., None], moved, kept)
    unsure = np.hypot(before.error, 0.5 + 0.2 * np.linalg.norm(kept - around, axis=-1))
    return Warp(position.astype(np.float32), seen, np.where(seen, error, unsure).astype(np.float32))


def _chain(before: Warp, last, new, hidden_last, hidden_new):
    """Positions one frame on by flow: guess (H, W, 2), where flow tells it (H, W) bool, its error (H, W)."""
    there, back = dense_flow(last, new), dense_flow(new, last)
    reach = before.position - pixel_grid(*last.shape)
    loop = carry(round_trip(there, back), reach)
    step = carry(there, reach)
    tells = before.seen & ~_at(hidden_last, before.position) & _shown(before.position + step, hidden_new)
    tells &= loop < 1.0 + 0.05 * np.linalg.norm(step, axis=-1)
    step = np.where(tells[..., None], step, spread(step, tells))
    return before.position + step, tells, 0.1 + 0.5 * loop


def _anchor(guess, first, new, hidden_first, hidden_new, before):
    """The guess less its drift against the first frame, where the first frame's texture is recognised.

    Tried from the guess, from what that gave, and from rest, where tissue that is let go returns to.
    """
    grid = pixel_grid(*first.shape)
    best, good, error = guess, np.zeros(first.shape, bool), before.error
    like, far = np.full(first.shape, RECOGNISED, np.float32), 0.15 * max(first.shape)
    for attempt in range(3):
        begin = (guess, best, grid)[attempt]
        usable = _shown(begin, hidden_new) & ~hidden_first
        pulled = cv2.remap(new, begin[..., 0], begin[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        pulled = np.where(usable, pulled, first)
        if attempt == 0:
            unmoved = likeness(first, pulled, usable)
        drift, back = dense_flow(first, pulled), dense_flow(pulled, first)
        loop = round_trip(drift, back)
        alike = likeness(first, carry(pulled, drift), usable)
        there = carry(begin, drift)
        away = np.linalg.norm(there - guess, axis=-1)
        near = (away < 1.5 + 3.0 * before.error) | ((away < far) & (alike > np.maximum(unmoved + 0.25, 0.75)))
        better = usable & (loop < 0.7) & near & (alike > like + (0.02 if attempt else 0.0))
        best = np.where(better[..., None], there, best)
        like = np.where(better, alike, like)
        error = np.where(better, 0.1 + 0.5 * loop, error)
        good |= better
        if attempt == 0:
            drift = spread(best - guess, good)
            best = np.where(good[..., None], best, guess + drift)
    moved = best - grid
    soft = cv2.GaussianBlur(moved, (0, 0), 1.0)
    return grid + np.where(good[..., None], soft, moved), good, error, np.where(good, like, unmoved)


def _at(mask: np.ndarray, position: np.ndarray) -> np.ndarray:
    x, y = position[..., 0].astype(np.float32), position[..., 1].astype(np.float32)
    return cv2.remap(mask.astype(np.uint8), x, y, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE) > 0


def _shown(position: np.ndarray, hidden: np.ndarray) -> np.ndarray:
    """Whether a position is inside the image and not hidden there."""
    height, width = hidden.shape
    x, y = position[..., 0], position[..., 1]
    return (x >= 0) & (y >= 0) & (x <= width - 1) & (y <= height - 1) & ~_at(hidden, position)
