"""The instrument by SAM 2, shown what to draw by clicks, one for each instrument in one frame, and by colour_motion.

With clicks on instruments these are followed through the clip (clicked.py). Without, colour_motion says in each frame
where something is, and SAM 2 draws its outline. Where it disagrees entirely, colour_motion is believed: it knows the
clip, SAM 2 only the frame.
"""

import cv2
import numpy as np

from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.config.masking import Masking
from surgisim.perception.masking import colour_motion
from surgisim.perception.masking.clicked import followed
from surgisim.perception.masking.drawing import Drawer, Embedded, drawer, inner_points, overlap

AGREE = 0.5
"""Overlap (intersection over union) with what colour_motion found below which that is kept."""
LEAST = 0.0008
"""Share of the frame below which a region is not drawn."""


def tool(frames: Frames, given: Given, settings: Masking, progress) -> tuple[np.ndarray, np.ndarray]:
    """Instrument pixels, and the network's own estimate of its overlap with the truth."""
    network, total = drawer(settings), len(frames.rgb)
    rough, confidence = colour_motion.tool(frames, given, settings, lambda d, t, words="": progress(0.2 * d, t, words))

    def draw_on(share: float) -> None:
        progress((0.2 + 0.8 * share) * total, total, "drawing outlines with SAM 2")

    if any(c.label == "tool" for c in settings.clicks):
        masks, confidence = followed(frames.rgb, rough, settings.clicks, network, draw_on)
        return masks, np.clip(confidence, 0, 1)
    masks = rough.copy()
    for t in range(total):
        draw_on(t / total)
        regions = _regions(rough[t])
        if not regions:
            continue
        embedded = network.embedded(frames.rgb[t])
        outside = [(c.x, c.y, 0) for c in settings.clicks if c.frame == t]
        drawn = [_drawn(network, embedded, region, outside) for region in regions]
        masks[t] = np.any([mask for mask, _ in drawn], axis=0)
        confidence[t] = float(np.mean([sure for _, sure in drawn]))
    return masks, np.clip(confidence, 0, 1)


def _regions(rough: np.ndarray) -> list[np.ndarray]:
    number, label = cv2.connectedComponents(rough.astype(np.uint8), connectivity=8)
    area = np.bincount(label.ravel(), minlength=number)
    return [label == index for index in range(1, number) if area[index] >= LEAST * rough.size]


def _drawn(network: Drawer, embedded: Embedded, region: np.ndarray, outside) -> tuple[np.ndarray, float]:
    """The best of the network's three outlines by a region's box and its thickest places, and how sure it is."""
    rows, columns = np.flatnonzero(region.any(1)), np.flatnonzero(region.any(0))
    box = [(columns[0], rows[0], 2), (columns[-1], rows[-1], 3)]
    answers = network.drawn(embedded, [*box, *((x, y, 1) for x, y in inner_points(region, 2)), *outside], region)
    agree = [overlap(mask, region) for mask, _ in answers]
    best = int(np.argmax([a + sure for a, (_, sure) in zip(agree, answers, strict=True)]))
    return answers[best] if agree[best] > AGREE else (region, 0.5)
