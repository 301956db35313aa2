"""Which of the found regions are instruments: they enter through the border and reach into the picture."""

import cv2
import numpy as np
from scipy import ndimage


def entering(found: np.ndarray) -> np.ndarray:
    """Those regions of `found` that are, through space and time, one thing entering from the border, (T, H, W) bool.

    A region may lose contact for some frames (a jaw in front of its reddish wrist); what counts is that it is
    one with a region that has it. Tissue of an unusual colour at the border lies along it and stays; an
    instrument reaches in, or moves.
    """
    count, height, width = found.shape
    label, number = ndimage.label(found, ndimage.generate_binary_structure(3, 2))
    inward = _inward(height, width)
    kept = np.zeros(number + 1, bool)
    for index, part in enumerate(ndimage.find_objects(label), 1):
        kept[index] = _is_instrument(label[part] == index, inward[part[1:]], count, height * width)
    return kept[label]


def _is_instrument(region: np.ndarray, inward: np.ndarray, count: int, pixels: int) -> bool:
    area = region.sum((1, 2))
    if area.max() < 0.003 * pixels or area.sum() < 0.0005 * pixels * count:
        return False
    contact = (region & (inward <= 2)).sum((1, 2)) / 3
    depth = np.where(region, inward, 0).max((1, 2))
    touching = contact > 0
    if not touching.any():
        return False
    reaches = np.median(depth[touching] / contact[touching]) > 0.6
    seen = area > 0.2 * area.max()
    ever, always = region.any(0).sum(), region[seen].mean(0)
    moves = (always > 0.8).sum() < 0.5 * ever
    return bool(reaches or moves)


def _inward(height: int, width: int) -> np.ndarray:
    """Distance of each pixel to the border [px], (H, W)."""
    y, x = np.mgrid[:height, :width]
    return np.minimum(np.minimum(x, width - 1 - x), np.minimum(y, height - 1 - y))


def solid(mask: np.ndarray) -> np.ndarray:
    """The mask with cracks closed, specks taken out and small holes filled, (H, W) bool."""
    closed = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    pixels = mask.size
    _, label, stats, _ = cv2.connectedComponentsWithStats(closed, connectivity=8)
    grain = stats[:, 4] < 0.0008 * pixels
    grain[0] = False
    closed[grain[label]] = 0
    _, label, stats, _ = cv2.connectedComponentsWithStats(1 - closed, connectivity=4)
    hole = stats[:, 4] < 0.006 * pixels
    hole[0] = False
    return closed.astype(bool) | hole[label]


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
