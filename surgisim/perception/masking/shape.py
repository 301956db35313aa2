"""Which of the found regions are instruments: they enter through the border and reach into the picture."""

import cv2
import numpy as np
from scipy import ndimage

from surgisim.side_by_side import in_order

CLEAR = 3.2
"""Evidence (3.9 at most) that a quarter of an instrument's own colours exceed: steel is not faintly grey."""


def entering(found: np.ndarray, evidence: np.ndarray, highlight: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Those regions of `found` that are, through space and time, one thing entering from the border, (T, H, W) bool.

    A region may lose contact for some frames (a jaw in front of its reddish wrist); what counts is that it is
    one with a region that has it. Tissue of an unusual colour at the border lies along it and stays; an
    instrument reaches in, or moves. `evidence` is that of the colour alone, `highlight` where the lamp is reflected;
    a region holding a `chosen` pixel is kept whatever it looks like.
    """
    count, height, width = found.shape
    label, number = ndimage.label(found, ndimage.generate_binary_structure(3, 2))
    inward = _inward(height, width)
    kept = np.zeros(number + 1, bool)
    for index, part in enumerate(ndimage.find_objects(label), 1):
        region = label[part] == index
        clear = _is_clear(evidence[part][region]) and highlight[part][region].mean() < 0.85
        kept[index] = clear and _is_instrument(region, inward[part[1:]], count, (height, width))
    kept[np.unique(label[chosen])] = True
    kept[0] = False
    each = zip(kept[label], evidence, highlight, [inward] * count, chosen, strict=True)
    return np.stack(list(in_order(_without_islands, each)))


def _is_clear(evidence: np.ndarray) -> bool:
    """Whether enough of a region is clearly not tissue; the rest may mirror it, or be blurred into it."""
    apart = evidence[evidence > 0]
    return len(apart) > 0.3 * len(evidence) and bool(np.quantile(apart, 0.75) > CLEAR)


def _is_instrument(region: np.ndarray, inward: np.ndarray, count: int, size: tuple[int, int]) -> bool:
    pixels = size[0] * size[1]
    area = region.sum((1, 2))
    if area.max() < 0.003 * pixels or area.sum() < 0.0005 * pixels * count:
        return False
    contact = (region & (inward <= 2)).sum((1, 2)) / 3
    depth = np.where(region, inward, 0).max((1, 2))
    touching = contact > 0
    if not touching.any():
        return False
    reaches = np.median(depth[touching] / contact[touching]) > 0.6 or depth.max() > 0.25 * min(size)
    present = area > 0.2 * area.max()
    always = region[present].mean(0) > 0.8
    moves = always.sum() < 0.3 * region.any(0).sum() and depth.max() > 0.08 * min(size)
    return bool(reaches or moves)


def _without_islands(mask, evidence, highlight, inward, chosen) -> np.ndarray:
    """Takes out highlights, and pieces that neither reach the border nor lie beside one that does unless large."""
    number, label, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    area = np.maximum(stats[:, 4], 1)
    shine = np.bincount(label.ravel(), highlight.ravel(), number) / area
    clear = np.bincount(label.ravel(), evidence.ravel(), number) / area
    contact = np.bincount(label.ravel(), (inward <= 2).ravel(), number) > 0
    kept = (contact & ((shine < 0.9) | (area > 0.01 * mask.size))) | ((area > 0.002 * mask.size) & (shine < 0.6))
    kept |= np.bincount(label.ravel(), chosen.ravel(), number) > 0
    kept[0] = False
    gap = 2 * max(mask.shape[1] // 80, 2) + 1
    beside = cv2.dilate(kept[label].astype(np.uint8), np.ones((gap, gap), np.uint8))
    kept |= (clear > 1) & (np.bincount(label.ravel(), beside.ravel(), number) > 0)
    kept[0] = False
    return kept[label]


def _inward(height: int, width: int) -> np.ndarray:
    """Distance of each pixel to the border [px], (H, W)."""
    y, x = np.mgrid[:height, :width]
    return np.minimum(np.minimum(x, width - 1 - x), np.minimum(y, height - 1 - y))


def solid(mask: np.ndarray, evidence: np.ndarray) -> np.ndarray:
    """The mask with cracks closed, specks taken out, and small holes filled that do not show tissue, (H, W) bool."""
    closed = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    pixels = mask.size
    _, label, stats, _ = cv2.connectedComponentsWithStats(closed, connectivity=8)
    grain = stats[:, 4] < 0.0004 * pixels
    grain[0] = False
    closed[grain[label]] = 0
    number, label, stats, _ = cv2.connectedComponentsWithStats(1 - closed, connectivity=4)
    area = np.maximum(stats[:, 4], 1)
    unclear = np.bincount(label.ravel(), evidence.ravel(), number) / area > -2
    hole = (area < 0.0004 * pixels) | ((area < 0.01 * pixels) & unclear)
    hole[0] = False
    return closed.astype(bool) | hole[label]


def bridged(mask: np.ndarray, evidence: np.ndarray) -> np.ndarray:
    """The mask with the gaps between an instrument's parts filled unless they clearly show tissue, (H, W) bool.

    Polished parts mirror the tissue; what lies between two parts of an instrument is mostly instrument too.
    """
    radius = max(round(0.03 * mask.shape[1]), 2)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))
    padded = np.pad(mask.astype(np.uint8), radius + 1, mode="edge")
    inside = slice(radius + 1, -radius - 1)
    closed = cv2.morphologyEx(padded, cv2.MORPH_CLOSE, disc)[inside, inside].astype(bool)
    return mask | (closed & (evidence > -3.5))


def snapped(frame: np.ndarray, mask: np.ndarray, *, band: int) -> np.ndarray:
    """The mask's outline moved to the nearest edge, within `band` px of where it was, (H, W) bool.

    GrabCut: Rother, Kolmogorov and Blake, GrabCut: interactive foreground extraction using iterated graph
    cuts, SIGGRAPH 2004.
    """
    if not mask.any() or mask.all():
        return mask
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * band + 1, 2 * band + 1))
    inner = cv2.erode(mask.astype(np.uint8), disc, borderValue=1).astype(bool)
    outer = cv2.dilate(mask.astype(np.uint8), disc).astype(bool)
    if not inner.any():
        return mask
    trimap = np.where(mask, cv2.GC_PR_FGD, cv2.GC_PR_BGD).astype(np.uint8)
    trimap[inner], trimap[~outer] = cv2.GC_FGD, cv2.GC_BGD
    # Colour models from near the outline only: those are the two sides it parts.
    rows, columns = np.flatnonzero(outer.any(1)), np.flatnonzero(outer.any(0))
    near = (
        slice(max(rows[0] - 4 * band, 0), rows[-1] + 4 * band + 1),
        slice(max(columns[0] - 4 * band, 0), columns[-1] + 4 * band + 1),
    )
    part = np.ascontiguousarray(trimap[near])
    if not (part == cv2.GC_BGD).any():
        return mask
    cv2.setRNGSeed(0)
    models = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.grabCut(np.ascontiguousarray(frame[near]), part, None, *models, 1, cv2.GC_INIT_WITH_MASK)
    result = mask.copy()
    result[near] = (part == cv2.GC_FGD) | (part == cv2.GC_PR_FGD)
    return result
