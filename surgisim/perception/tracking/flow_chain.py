"""Follow points by dense flow anchored to the first frame; needs no weights.

Each point rides on the surface around it (correspond.py) and is then set to a fraction of a pixel by its own patch of
the first frame (refine.py). Where the patch is not recognised, the surface alone carries it on from where it last was,
and its sigma says so.
"""

from collections.abc import Callable

import cv2
import numpy as np

from surgisim.artifacts.correspondence import Correspondence
from surgisim.config.tracking import Tracking
from surgisim.perception.tracking import Paths
from surgisim.perception.tracking.between import sample
from surgisim.perception.tracking.correspond import widen
from surgisim.perception.tracking.refine import Found, Templates, find, templates
from surgisim.side_by_side import in_order

LIKE, STRANGE = 0.7, 0.2
"""Correlation with the first frame's patch from which a point is recognised; below which it cannot be that point."""


def track(
    rgb: np.ndarray,
    surface: Correspondence,
    specular: np.ndarray,
    queries: np.ndarray,
    *,
    settings: Tracking,
    progress: Callable[[float, float, str], None] | None = None,
) -> Paths:
    """Where `queries` of frame 0, (K, 2) [px], went.

    rgb: sRGB, (T, H, W, 3) uint8. surface: where frame 0's pixels went. specular: highlights, (T, H, W) bool.
    """
    side = max(rgb.shape[1:3])
    hidden = surface.hidden
    radius = int(np.clip(round(settings.patch * side), 4, 12))
    bright = hidden | np.stack([widen(mask, 1) for mask in specular])
    patches = templates(_grey(rgb[0]), queries, bright[0], radius=radius)
    rows, shift = [], np.zeros(queries.shape)

    def found_in(t: int) -> tuple[np.ndarray, Found]:
        position = surface.position(t)
        return position, find(patches, _grey(rgb[t]), position, bright[t])

    for t, (position, found) in enumerate(in_order(found_in, zip(range(len(rgb))))):
        *row, shift = _place(patches, position, surface.seen[t], surface.error[t], found, hidden[t], shift)
        rows.append(row)
        if progress:
            progress(t + 1, len(rgb), "finding points by their patches")
    xy, visible, sigma = (np.stack(part, 1) for part in zip(*rows, strict=True))
    return Paths(xy.astype(np.float32), visible, sigma.astype(np.float32))


def _place(
    patches: Templates,
    position: np.ndarray,
    followed: np.ndarray,
    error: np.ndarray,
    found: Found,
    hidden: np.ndarray,
    last: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Where the points are, whether they are seen, how sure, and their shifts against the surface, (K, 2) [px].

    position, followed, error: of the surface, see `Correspondence`. last: the points' shifts in the frame before: what
    the surface has wrong in a place it has wrong in the next frame, too.
    """
    error = sample(error, patches.queries[:, None])[:, 0]
    seen = sample(followed.astype(np.float32), patches.queries[:, None])[:, 0] > 0.5
    far = np.linalg.norm(found.shift, axis=-1)
    known = (found.likeness > LIKE) & (found.sigma < 1.0) & (far < 1.0 + 3.0 * error)
    shift = np.where(known[:, None], found.shift, last)
    at = patches.queries + shift
    xy = sample(position, at[:, None])[:, 0]
    height, width = hidden.shape
    inside = (xy >= 0).all(-1) & (xy[:, 0] <= width - 1) & (xy[:, 1] <= height - 1)
    covered = sample(hidden.astype(np.float32), xy[:, None])[:, 0] > 0.25
    visible = (known | (seen & (found.likeness > STRANGE))) & inside & ~covered
    return xy, visible, np.maximum(np.where(known, found.sigma, error), 0.03), shift


def _grey(rgb: np.ndarray) -> np.ndarray:
    return cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY).astype(np.float32)
