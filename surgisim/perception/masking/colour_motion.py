"""The instrument by its colour, its entry from the border and its motion; no weights.

Tissue is red because of blood; steel, plastic and paint are not. How red this clip's tissue is, is learned from
the clip; then the clip's own colours of instrument and tissue, in two rounds; then evidence is shared between
frames along the optical flow, and the outline drawn to the nearest edge.
"""

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter

from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.config.masking import Masking
from surgisim.perception.flow import agrees, carry, dense_flow
from surgisim.perception.masking.appearance import features, lit
from surgisim.perception.masking.shape import entering, snapped, solid

BINS = 24
LOW, HIGH = np.array([-0.7, -1.0, 2.0]), np.array([1.2, 1.0, 5.6])
"""Range of the features that the colour tables cover."""
ROUNDS = 2


def tool(frames: Frames, given: Given, settings: Masking, progress) -> tuple[np.ndarray, np.ndarray]:
    """Instrument pixels, and how clearly they stand out."""
    rgb, total = frames.rgb, len(frames.rgb)
    inside = lit(rgb)
    seen = np.stack([features(frame) for frame in rgb])
    evidence = _by_redness(seen)
    bins = _bins(seen)
    grey = [cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY).astype(np.float32) / 255 for frame in rgb]
    prior = evidence
    for _ in range(ROUNDS):
        found = _regions(grey, evidence, inside)
        if not found.any():
            return found, np.zeros(total)
        evidence = 0.6 * prior + 0.6 * _by_colour(bins, found, inside)
    progress(0.3 * total, total, "following the instrument")
    evidence = _shared_in_time(rgb, evidence, settings, progress)
    found = _regions(grey, evidence, inside)
    if settings.refine:
        band = max(rgb.shape[2] // 80, 2)
        found = np.stack([snapped(frame, mask, band=band) for frame, mask in zip(rgb, found, strict=True)])
        found = entering(np.stack([solid(m) for m in found]) & inside)
    return found, _confidence(evidence, found)


def _by_redness(seen: np.ndarray) -> np.ndarray:
    """Evidence for instrument (> 0) or tissue (< 0) from red over green alone, (T, H, W)."""
    red = seen[..., 0]
    sample = red[:: max(len(red) // 12, 1)]
    blooded = sample[sample > 0.08]
    typical = float(np.median(blooded)) if len(blooded) else 0.3
    level = 0.4 * typical
    # Pale tissue: where most of the picture would count as instrument, only what is paler still does.
    while (sample < level).mean() > 0.45 and level > -0.3:
        level -= 0.02
    evidence = 3 * np.clip((level - red) / (0.2 * typical), -1.3, 1.3)
    # Burnt-out white has lost its colour, and black never had any.
    brightness = np.exp(seen[..., 2]) - 8
    return evidence * np.clip((brightness - 8) / 24, 0.1, 1) * np.where(brightness > 250, 0.3, 1)


def _bins(seen: np.ndarray) -> np.ndarray:
    index = np.clip((seen - LOW) / (HIGH - LOW) * BINS, 0, BINS - 1).astype(np.int32)
    return (index[..., 0] * BINS + index[..., 1]) * BINS + index[..., 2]


def _by_colour(bins: np.ndarray, found: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Logarithm of how much likelier a colour is on what was found than elsewhere, at most 4 either way, (T, H, W)."""
    tables = []
    for chosen in (found, inside & ~found):
        table = np.bincount(bins[chosen], minlength=BINS**3).reshape(BINS, BINS, BINS).astype(np.float64)
        tables.append(gaussian_filter(table, 1.0).ravel() / max(chosen.sum(), 1))
    ratio = np.log((tables[0] + 2e-6) / (tables[1] + 2e-6))
    return np.clip(ratio, -4, 4)[bins].astype(np.float32)


def _regions(grey: list[np.ndarray], evidence: np.ndarray, inside: np.ndarray) -> np.ndarray:
    smooth = (edge_aware(g, e, radius=2) for g, e in zip(grey, evidence, strict=True))
    return entering(np.stack([solid(s > 0) for s in smooth]) & inside)


def edge_aware(guide: np.ndarray, values: np.ndarray, *, radius: int, softness: float = 1e-3) -> np.ndarray:
    """`values` smoothed, but not across edges of `guide`, (H, W).

    He, Sun and Tang, Guided image filtering, ECCV 2010.
    """
    mean = lambda a: cv2.blur(a, (2 * radius + 1, 2 * radius + 1))  # noqa: E731
    guide_mean, values_mean = mean(guide), mean(values)
    slope = (mean(guide * values) - guide_mean * values_mean) / (mean(guide * guide) - guide_mean**2 + softness)
    return mean(slope) * guide + mean(values_mean - slope * guide_mean)


def _shared_in_time(rgb, evidence: np.ndarray, settings: Masking, progress) -> np.ndarray:
    """Evidence averaged with that of the neighbouring frames along the flow, clicks put in and carried on."""
    marked = _clicks(evidence.shape, settings)
    total = len(rgb)
    summed, weight = evidence.copy(), np.ones_like(evidence)
    forward = backward = marked.copy()
    backward = marked.copy()
    steps = []
    for t in range(total - 1):
        there, back = dense_flow(rgb[t], rgb[t + 1]), dense_flow(rgb[t + 1], rgb[t])
        steps.append((there, back))
        for a, b, way, other in ((t, t + 1, there, back), (t + 1, t, back, there)):
            trusted = 0.6 * agrees(way, other)
            summed[a] += trusted * carry(evidence[b], way)
            weight[a] += trusted
        forward[t + 1] = np.where(forward[t + 1] == 0, 0.97 * carry(forward[t], back), forward[t + 1])
        progress((0.3 + 0.5 * t / total) * total, total, "following the instrument")
    for t in reversed(range(total - 1)):
        backward[t] = np.where(backward[t] == 0, 0.97 * carry(backward[t + 1], steps[t][0]), backward[t])
    return summed / weight + forward + backward


def _clicks(shape: tuple[int, ...], settings: Masking) -> np.ndarray:
    """Strong evidence in a small disc around each marked point, (T, H, W)."""
    marked = np.zeros(shape, np.float32)
    for click in settings.clicks:
        sign = 12.0 if click.label == "tool" else -12.0
        cv2.circle(marked[click.frame], (round(click.x), round(click.y)), max(shape[2] // 50, 3), sign, -1)
    return marked


def _confidence(evidence: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Share of the evidence, by weight, that agrees with the outline; 0 where nothing was found, (T,)."""
    for_it = np.where(found, np.clip(evidence, 0, 4), 0).sum((1, 2))
    against = np.where(found, np.clip(-evidence, 0, 4), np.clip(evidence, 0, 4)).sum((1, 2))
    return np.where(found.any((1, 2)), for_it / np.maximum(for_it + against, 1e-9), 0.0)
