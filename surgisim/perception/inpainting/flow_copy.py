"""Fill what the instrument hides from frames that saw it, following the tissue; then invent the rest, once.

Tissue hidden now was, or will be, seen: the motion of the tissue around the instrument is continued behind it
and followed from frame to frame until the pixel is in view, in both directions. Copies are lit like the rim of the
hole they fill. What no frame ever saw is grown inward from the rim in one frame and carried from there to the others,
so that it does not flicker; near the rim it is what grows from each frame's own.
"""

from collections.abc import Callable
from itertools import pairwise

import cv2
import numpy as np

from surgisim.artifacts.inpainted import COPIED, INVENTED, SEEN
from surgisim.config.inpainting import Inpainting
from surgisim.perception.inpainting.smooth import continued
from surgisim.perception.inpainting.source import Source, behind, followed, seen
from surgisim.perception.optical_flow import Flow
from surgisim.perception.optical_flow.choice import chosen
from surgisim.perception.tracking.between import sample
from surgisim.side_by_side import in_order

RIM = 0.04
"""How far from known tissue a hole's edges tell [longest side]."""
TELEA = 0.03
"""How far around a pixel its edges are looked for [longest side]."""
Invent = Callable[[np.ndarray, np.ndarray], np.ndarray]


def fill(rgb: np.ndarray, hole: np.ndarray, settings: Inpainting, progress) -> tuple[np.ndarray, np.ndarray]:
    """Frames (T, H, W, 3) uint8 without their holes, and each pixel's origin (T, H, W) uint8."""
    return fill_with(rgb, hole, settings, progress, invent=grown_inward)


def fill_with(rgb, hole, settings: Inpainting, progress, *, invent: Invent) -> tuple[np.ndarray, np.ndarray]:
    """As `fill`, with `invent(frame, hole) -> frame` for what no frame saw."""
    total = len(rgb)
    flow = chosen(settings.flow, settings.flow_weights, stage="inpainting")
    to_next, to_last = _tissue_motion(rgb, hole, flow, progress)
    earlier, later = in_order(_swept, ((range(total), to_last, hole), (range(total - 1, -1, -1), to_next, hole)))
    filled, known = rgb.copy(), ~hole

    def copies(t: int) -> tuple[np.ndarray, np.ndarray]:
        colors, weight = np.zeros(rgb.shape[1:], np.float32), np.zeros(hole.shape[1:], np.float32)
        for source in (earlier[t], later[t]):
            away = abs(source.frame - t)
            copied = hole[t] & source.found & (away <= settings.reach)
            # Each step from frame to frame adds an error of its own.
            share = 1 / np.maximum(away[copied], 1).astype(np.float32)
            colors[copied] += share[:, None] * _lit_alike(rgb, hole, source, t, copied)
            weight[copied] += share
        copied = weight > 0
        return copied, np.rint(colors[copied] / weight[copied][:, None]).astype(np.uint8)

    for t, (copied, colors) in enumerate(in_order(copies, zip(range(total)))):
        progress(total * (0.5 + 0.3 * t / total), total, "copying what other frames saw")
        filled[t][copied] = colors
        known[t] |= copied
    origin = np.where(hole, np.where(known, COPIED, INVENTED), SEEN).astype(np.uint8)
    _invent_into(filled, known, to_next, to_last, invent, progress)
    return filled, origin


def grown_inward(frame: np.ndarray, hole: np.ndarray) -> np.ndarray:
    """Edges continued near the rim, smooth colour farther in.

    Telea, An image inpainting technique based on the fast marching method, 2004; far from any rim it only draws
    streaks, and where a hole leaves the image it goes astray, so there the smooth continuation leads.
    """
    smooth = np.clip(continued(frame.astype(np.float32), ~hole), 0, 255)
    guided = np.where(hole[..., None], np.rint(smooth), frame).astype(np.uint8)
    pad = 8
    wide = cv2.copyMakeBorder(guided, pad, pad, pad, pad, cv2.BORDER_REPLICATE)
    inner = cv2.copyMakeBorder(hole.astype(np.uint8), pad, pad, pad, pad, cv2.BORDER_CONSTANT, value=0)
    edges = cv2.inpaint(wide, inner, TELEA * max(hole.shape), cv2.INPAINT_TELEA)[pad:-pad, pad:-pad].astype(np.float32)
    share = _near_rim(hole)[..., None]
    return np.where(hole[..., None], np.rint(share * edges + (1 - share) * smooth), frame).astype(np.uint8)


def _near_rim(hole: np.ndarray) -> np.ndarray:
    """1 at the rim of a hole, falling to 0 inside it, (H, W)."""
    away = cv2.distanceTransform(hole.astype(np.uint8), cv2.DIST_L2, 5) / (RIM * max(hole.shape))
    return np.clip(1 - away, 0, 1)


def _tissue_motion(rgb, hole, flow: Flow, progress) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Flow of the tissue t -> t + 1 (last entry unused) and t -> t - 1 (first unused)."""
    still = np.zeros((*rgb.shape[1:3], 2), np.float32)
    # The instrument is smoothed away first: its edges would drag the flow of the tissue beside it along.
    veiled = in_order(_veiled, zip(rgb, hole, strict=True))
    to_next, to_last = [], [still]
    pairs = ((flow, *frames, *holes) for frames, holes in zip(pairwise(veiled), pairwise(hole), strict=True))
    for t, (on, back) in enumerate(in_order(_between, pairs)):
        progress(len(rgb) * 0.5 * t / len(rgb), len(rgb), "following the tissue")
        to_next.append(on)
        to_last.append(back)
    return [*to_next, still], to_last


def _veiled(frame: np.ndarray, hole: np.ndarray) -> np.ndarray:
    return np.rint(continued(frame.astype(np.float32), ~hole)).clip(0, 255).astype(np.uint8)


def _between(flow: Flow, one, other, hole_one, hole_other) -> tuple[np.ndarray, np.ndarray]:
    """Flow of the tissue from one frame to another, and back."""
    there, back = flow(one, other), flow(other, one)
    return behind(there, back, hole_one, hole_other), behind(back, there, hole_other, hole_one)


def _swept(order, flow: list[np.ndarray], hole: np.ndarray) -> dict[int, Source]:
    """Sources of each frame among the frames before it in `order`."""
    sources: dict[int, Source] = {}
    before: Source | None = None
    for t in order:
        before = seen(t, hole[t]) if before is None else followed(before, flow[t], t, hole[t])
        sources[t] = before
    return sources


def _lit_alike(rgb, hole, source: Source, t: int, copied: np.ndarray) -> np.ndarray:
    """Copied colours, corrected by what the rim of the hole would have been off by, (N, 3) float32."""
    colours = _looked_up(rgb, source, copied)
    frame, xy = source.frame, source.xy
    ring = cv2.dilate(copied.astype(np.uint8), np.ones((9, 9), np.uint8)).astype(bool) & ~hole[t]
    if not ring.any():
        return colours
    _, label = cv2.distanceTransformWithLabels(
        (~copied).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    at = np.zeros((label.max() + 1, 2), int)
    rows, columns = np.nonzero(copied)
    at[label[rows, columns]] = np.stack([rows, columns], -1)
    nearest = at[label]
    y, x = nearest[..., 0], nearest[..., 1]
    offset = np.stack([np.arange(hole.shape[2])[None] - x, np.arange(hole.shape[1])[:, None] - y], -1)
    place = xy[y, x] + offset
    height, width = hole.shape[1:]
    inside = (place >= 0).all(-1) & (place[..., 0] <= width - 1) & (place[..., 1] <= height - 1)
    ring &= inside & (frame[y, x] >= 0)
    i, j = np.rint(place[..., 1]).astype(int).clip(0, height - 1), np.rint(place[..., 0]).astype(int).clip(0, width - 1)
    ring &= ~hole[frame[y, x].clip(0), i, j]
    if not ring.any():
        return colours
    there = _looked_up(rgb, Source(frame[y, x], place.astype(np.float32)), ring)
    off = np.zeros((height, width, 3), np.float32)
    off[ring] = np.clip(rgb[t][ring] - there, -40, 40)
    weight = ring.astype(np.float32)
    mean = cv2.GaussianBlur(off, (0, 0), 3) / np.maximum(cv2.GaussianBlur(weight, (0, 0), 3), 1e-6)[..., None]
    correction = continued(mean, ring)[copied]
    return np.clip(colours + correction, 0, 255)


def _looked_up(rgb: np.ndarray, source: Source, chosen: np.ndarray) -> np.ndarray:
    """Colour at the sources of the chosen pixels, interpolated, (N, 3) float32."""
    colours = np.zeros((int(chosen.sum()), 3), np.float32)
    frame, xy = source.frame[chosen], source.xy[chosen]
    for s in np.unique(frame):
        mine = frame == s
        colours[mine] = sample(rgb[s], xy[mine])
    return colours


def _invent_into(filled, known, to_next, to_last, invent: Invent, progress) -> None:
    """Fill what is left, beginning in the frame that lacks most and carrying that to both ends."""
    total, gap = len(filled), ~known
    if not gap.any():
        return
    lacking = [t for t in range(total) if gap[t].any()]
    invented = in_order(invent, ((filled[t], gap[t]) for t in lacking))
    for done, (t, alone) in enumerate(zip(lacking, invented, strict=True)):
        progress(total * (0.8 + 0.2 * done / len(lacking)), total, "inventing what no frame saw")
        filled[t] = alone
    first = int(np.argmax(gap.sum((1, 2))))

    def onward(order: range, flow: list[np.ndarray]) -> None:
        before = seen(first, np.zeros_like(gap[first]))
        for t in order:
            here = followed(before, flow[t], t, gap[t])
            taken, left = gap[t] & here.found, gap[t] & ~here.found
            share = _near_rim(gap[t])[taken][:, None]
            carried = share * filled[t][taken] + (1 - share) * _looked_up(filled, here, taken)
            filled[t][taken] = np.rint(carried).astype(np.uint8)
            before = Source(np.where(left, t, here.frame), here.xy)

    for _ in in_order(onward, ((range(first + 1, total), to_last), (range(first - 1, -1, -1), to_next))):
        pass
