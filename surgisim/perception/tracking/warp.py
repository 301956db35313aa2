"""Follow every pixel of the first frame through a recording.

From frame to frame by dense flow, and again and again straight from the first frame: each frame is pulled back
to the first by what is known so far, and the flow that remains is the drift to take out. Behind an instrument the
surface is guessed from its surroundings, until it is found again. A flow that finds what went far is asked straight
from the first frame to each, too, where there is one.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from surgisim.perception.flow import carry, pixel_grid, round_trip
from surgisim.perception.optical_flow import Flow
from surgisim.perception.optical_flow.dis import dense_flow
from surgisim.perception.tracking.spread import spread
from surgisim.side_by_side import in_order

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


@dataclass(frozen=True)
class _Found:
    """What a frame, pulled back to the first by some positions, has to do with it."""

    begin: np.ndarray
    """Those positions [px], (H, W, 2)."""
    usable: np.ndarray
    """Where they are in the picture and not hidden, (H, W) bool."""
    pulled: np.ndarray
    """The frame there, and the first where it is not usable, (H, W) uint8."""
    there: np.ndarray
    """The positions less the drift that flow finds [px], (H, W, 2)."""
    loop: np.ndarray
    """How far flow and flow back do not meet [px], (H, W)."""
    alike: np.ndarray
    """Correlation with the first frame once there, (H, W)."""


def follow_surface(
    rgb: np.ndarray,
    hidden: np.ndarray,
    *,
    far: Flow | None = None,
    progress: Callable[[float, float, str], None] | None = None,
) -> Iterator[Warp]:
    """One Warp a frame, the first being the identity.

    rgb: sRGB, (T, H, W, 3) uint8. hidden: pixels that do not show the surface, (T, H, W) bool. far: flow to look for
    the surface by in each frame straight from the first.
    """
    grid = pixel_grid(*rgb.shape[1:3])
    grey = list(in_order(flat_light, zip(rgb)))
    now = Warp(grid.copy(), ~hidden[0], np.full(grid.shape[:2], 0.1, np.float32))
    yield now

    def beforehand(t: int) -> tuple[tuple[np.ndarray, np.ndarray], list[_Found]]:
        both = dense_flow(grey[t - 1], grey[t]), dense_flow(grey[t], grey[t - 1])
        starts = [grid] if far is None else [grid, grid + far(rgb[0], rgb[t])]
        return both, [_found(start, grey[0], grey[t], hidden[0], hidden[t]) for start in starts]

    for t, known in enumerate(in_order(beforehand, zip(range(1, len(rgb)))), 1):
        now = _advance(now, *known, grey[0], grey[t], hidden[0], hidden[t - 1], hidden[t])
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


def _advance(before: Warp, both, from_first: list[_Found], first, new, hidden_first, hidden_last, hidden_new) -> Warp:
    """both: flow from the frame before and back to it. from_first: see `_anchor`."""
    grid = pixel_grid(*first.shape)
    guess, chained, step_error = _chain(before, *both, hidden_last, hidden_new)
    position, anchored, anchor_error, like = _anchor(guess, from_first, first, new, hidden_first, hidden_new, before)
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


def _chain(before: Warp, there, back, hidden_last, hidden_new):
    """Positions one frame on by flow: guess (H, W, 2), where flow tells it (H, W) bool, its error (H, W)."""
    reach = before.position - pixel_grid(*hidden_last.shape)
    loop = carry(round_trip(there, back), reach)
    step = carry(there, reach)
    tells = before.seen & ~_at(hidden_last, before.position) & _shown(before.position + step, hidden_new)
    tells &= loop < 1.0 + 0.05 * np.linalg.norm(step, axis=-1)
    step = np.where(tells[..., None], step, spread(step, tells))
    return before.position + step, tells, 0.1 + 0.5 * loop


def _anchor(guess, from_first: list[_Found], first, new, hidden_first, hidden_new, before):
    """The guess less its drift against the first frame, where the first frame's texture is recognised.

    Tried from the guess, from what that gave, and from what asks the first frame alone: rest, where tissue that is let
    go returns to, and the flow that finds what went far.
    """
    grid = pixel_grid(*first.shape)
    best, good, error = guess, np.zeros(first.shape, bool), before.error
    like, far = np.full(first.shape, RECOGNISED, np.float32), 0.15 * max(first.shape)
    for attempt in range(2 + len(from_first)):
        found = from_first[attempt - 2] if attempt > 1 else _found(best, first, new, hidden_first, hidden_new)
        if attempt == 0:
            unmoved = likeness(first, found.pulled, found.usable)
        away = np.linalg.norm(found.there - guess, axis=-1)
        near = (away < 1.5 + 3.0 * before.error) | ((away < far) & (found.alike > np.maximum(unmoved + 0.25, 0.75)))
        better = found.usable & (found.loop < 0.7) & near & (found.alike > like + (0.02 if attempt else 0.0))
        best = np.where(better[..., None], found.there, best)
        like = np.where(better, found.alike, like)
        error = np.where(better, 0.1 + 0.5 * found.loop, error)
        good |= better
        if attempt == 0:
            drift = spread(best - guess, good)
            best = np.where(good[..., None], best, guess + drift)
    moved = best - grid
    soft = cv2.GaussianBlur(moved, (0, 0), 1.0)
    return grid + np.where(good[..., None], soft, moved), good, error, np.where(good, like, unmoved)


def _found(begin: np.ndarray, first, new, hidden_first, hidden_new) -> _Found:
    usable = _shown(begin, hidden_new) & ~hidden_first
    pulled = cv2.remap(new, begin[..., 0], begin[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    pulled = np.where(usable, pulled, first)
    drift, back = in_order(dense_flow, ((first, pulled), (pulled, first)))
    alike = likeness(first, carry(pulled, drift), usable)
    return _Found(begin, usable, pulled, carry(begin, drift), round_trip(drift, back), alike)


def _at(mask: np.ndarray, position: np.ndarray) -> np.ndarray:
    x, y = position[..., 0].astype(np.float32), position[..., 1].astype(np.float32)
    return cv2.remap(mask.astype(np.uint8), x, y, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE) > 0


def _shown(position: np.ndarray, hidden: np.ndarray) -> np.ndarray:
    """Whether a position is inside the image and not hidden there."""
    height, width = hidden.shape
    x, y = position[..., 0], position[..., 1]
    return (x >= 0) & (y >= 0) & (x <= width - 1) & (y <= height - 1) & ~_at(hidden, position)
