"""The instrument by its colour, its entry from the border and its motion; no weights.

Tissue is red because of blood; steel, plastic and paint are not. How red this clip's tissue is, is learned from
the clip; then the clip's own colours of instrument and tissue, in a few rounds; then evidence is shared between
frames along the optical flow. Points marked by the user count for more than any colour.
"""

from itertools import pairwise

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter
from skimage.filters import threshold_otsu

from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.config.masking import Masking
from surgisim.perception.flow import agrees, carry
from surgisim.perception.masking.appearance import OFFSET, features, highlights, lit
from surgisim.perception.masking.settling import settled
from surgisim.perception.masking.shape import bridged, entering, snapped, solid
from surgisim.perception.optical_flow.dis import dense_flow
from surgisim.side_by_side import in_order

BINS = 24
LOW, HIGH = np.array([-0.7, -1.0, 2.0]), np.array([1.2, 1.0, 5.6])
"""Range of the features that the colour tables cover."""
ROUNDS = 4
FULL = 3.9
"""Evidence of a colour that could not be clearer: the logarithm of the odds."""
BRIGHT, BURNT = 215, 240
"""Brightest channel from which a camera compresses it; from which it is lost [0-255]."""
REDDISH = 0.03
"""Logarithm of red over green above which a bright surface is not white."""
MOSTLY = 0.6
"""Least share of what is found that is not red either. Where smoke is as grey as steel, colours learned from one lead
to the other, more of it each round; none that was learned is used then. What a user marks may be of any colour."""


def tool(frames: Frames, given: Given, settings: Masking, progress) -> tuple[np.ndarray, np.ndarray]:
    """Instrument pixels, and how clearly they stand out."""
    rgb, total = frames.rgb, len(frames.rgb)
    inside, shine = lit(rgb), np.stack(list(in_order(highlights, zip(rgb))))
    seen = np.stack(list(in_order(features, zip(rgb))))
    bins = np.stack(list(in_order(_bins, zip(seen))))
    motion = _motion(rgb, progress)
    marked = _clicks(frames.rgb.shape[:3], settings, motion)
    prior = _by_redness(seen) + marked

    def region(frame: np.ndarray, evidence: np.ndarray, prior: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        smooth = settled(frame, evidence)
        return smooth, solid(smooth > 0, prior)

    def regions(evidence: np.ndarray) -> np.ndarray:
        smooth, whole = zip(*in_order(region, zip(rgb, evidence, prior, strict=True)), strict=True)
        found = entering(np.stack(whole) & inside, prior, shine, marked > 6)
        return np.stack(list(in_order(bridged, zip(found, smooth, strict=True)))) & inside & (marked > -6)

    evidence, found = prior, regions(prior)
    for turn in range(ROUNDS):
        if not found.any():
            return found, np.zeros(total)
        progress((0.5 + 0.4 * turn / ROUNDS) * total, total, "learning its colours")
        learned = 0.3 * prior + _by_colour(bins, found, inside) + marked
        shown = regions(learned)
        if not settings.clicks and (prior[shown] > 0).sum() < MOSTLY * shown.sum():
            evidence = prior
            break
        evidence, found = learned, shown
    evidence = _shared_in_time(evidence, motion)
    found = regions(evidence)
    if settings.refine:
        band = max(rgb.shape[2] // 80, 2)
        found = np.stack([snapped(frame, mask, band=band) for frame, mask in zip(rgb, found, strict=True)]) & inside
    return found, _confidence(evidence, found)


def _by_redness(seen: np.ndarray) -> np.ndarray:
    """Evidence for instrument (> 0) or tissue (< 0) from red over green, (T, H, W)."""
    red, brightness = seen[..., 0], seen[..., 2]
    some = slice(None, None, max(len(red) // 12, 1))
    blooded = red[some][red[some] > 0.08]
    typical = float(np.median(blooded)) if len(blooded) else 0.3
    level = 0.4 * typical
    evidence = FULL * np.clip((level - red) / (0.26 * typical), -1, 1)
    bloodless = red[some] < level
    if bloodless.mean() > 0.3:
        # So much cannot be instrument: the tissue is pale here (fat, fascia), and pale tissue is bright.
        dark = float(threshold_otsu(brightness[some][bloodless]))
        evidence = np.minimum(evidence, FULL * np.clip((dark - brightness) / 0.2, -1, 1))
    # Burnt-out white has lost its colour, and black never had any. Where red is burnt out and exceeds green still, the
    # surface is redder than it looks.
    shown = np.exp(brightness) - OFFSET
    burnt = np.clip((shown - BRIGHT) / (BURNT - BRIGHT), 0, 1) * (red > REDDISH)
    evidence = np.where(evidence > 0, evidence * (1 - burnt) - 0.5 * FULL * burnt, evidence)
    return evidence * np.clip((shown - 4) / 16, 0.1, 1) * np.where(shown > BURNT, 0.2, 1)


def _bins(seen: np.ndarray) -> np.ndarray:
    index = np.clip((seen - LOW) / (HIGH - LOW) * BINS, 0, BINS - 1).astype(np.int32)
    return (index[..., 0] * BINS + index[..., 1]) * BINS + index[..., 2]


def _by_colour(bins: np.ndarray, found: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Logarithm of how much likelier a colour is on what was found than elsewhere, at most 4 either way, (T, H, W)."""
    tables = []
    for chosen in (found, inside & ~found):
        table = np.bincount(bins[chosen], minlength=BINS**3).reshape(BINS, BINS, BINS).astype(np.float64)
        tables.append(gaussian_filter(table, 1.0).ravel() / max(chosen.sum(), 1))
    ratio = np.clip(np.log((tables[0] + 2e-6) / (tables[1] + 2e-6)), -4, 4).astype(np.float32)
    return np.stack(list(in_order(ratio.take, zip(bins))))


def _motion(rgb: np.ndarray, progress) -> list[tuple[np.ndarray, np.ndarray]]:
    """Flow t -> t + 1 and t + 1 -> t for each t [px]."""

    def both(one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return dense_flow(one, other), dense_flow(other, one)

    pairs = []
    for pair in in_order(both, pairwise(rgb)):
        progress(0.5 * len(pairs), len(rgb), "following what moves")
        pairs.append(pair)
    return pairs


def _shared_in_time(evidence: np.ndarray, motion: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Evidence averaged with that of the neighbouring frames where the flow can be trusted, (T, H, W)."""

    def told(of: np.ndarray, way: np.ndarray, back: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        trusted = 0.3 * agrees(way, back)
        return trusted * carry(of, way), trusted

    asked = [ask for t, (on, back) in enumerate(motion) for ask in ((t, t + 1, on, back), (t + 1, t, back, on))]
    summed, weight = evidence.copy(), np.ones_like(evidence)
    answers = in_order(told, ((evidence[b], way, back) for _, b, way, back in asked))
    for (a, *_), (more, trusted) in zip(asked, answers, strict=True):
        summed[a] += more
        weight[a] += trusted
    return summed / weight


def _clicks(shape: tuple[int, ...], settings: Masking, motion: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Strong evidence in a small disc around each marked point, carried to the other frames, fading, (T, H, W)."""
    marked = np.zeros(shape, np.float32)
    if not settings.clicks:
        return marked
    for click in settings.clicks:
        sign = 12.0 if click.label == "tool" else -12.0
        cv2.circle(marked[click.frame], (round(click.x), round(click.y)), max(shape[2] // 50, 3), sign, -1)
    later, earlier = marked.copy(), marked.copy()
    for t, (_, back) in enumerate(motion):
        later[t + 1] = np.where(later[t + 1] == 0, 0.97 * carry(later[t], back), later[t + 1])
    for t, (there, _) in reversed(list(enumerate(motion))):
        earlier[t] = np.where(earlier[t] == 0, 0.97 * carry(earlier[t + 1], there), earlier[t])
    return np.where(marked != 0, marked, later + earlier)


def _confidence(evidence: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Share of the evidence, by weight, that agrees with the outline; 0 where nothing was found, (T,)."""
    for_it = np.where(found, np.clip(evidence, 0, 4), 0).sum((1, 2))
    against = np.where(found, np.clip(-evidence, 0, 4), np.clip(evidence, 0, 4)).sum((1, 2))
    return np.where(found.any((1, 2)), for_it / np.maximum(for_it + against, 1e-9), 0.0)
