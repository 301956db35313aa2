"""Grey light that smoke, or light scattered on its way, lays over a picture.

A surface of one colour keeps the ratios of its channels from bright to dark, so that its pixels lie on a line through
black; under a veil the line misses black by the veil's own light (colour lines: Fattal, Dehazing using color-lines, ACM
Transactions on Graphics 34, 2014). Tissue of several colours has several lines; here all of it shares one. The film on
wet tissue whitens what faces the lamp, that is, what is bright, which bends the line the other way: so the brightest
part is left out, and what is found is rather too little. On forty invented clips without smoke it is .004 at most, with
smoke two thirds of what is there (docs/benchmarks/coverage.md).
"""

import cv2
import numpy as np

from surgisim.lighting.headlight import linear_light

FRAMES, SIZE = 6, 64
"""Frames of a recording that are looked at, and their longer side [px]."""
DARKER = 0.7
"""Share of the pixels, from the darkest, that is looked at: of .5, .7 and 1 the best on forty clips of family 8086."""
ABOVE = 0.1
"""Share of a veil's own light that tissue must send through it: what is darker, the veil drowns."""
BINS = 12
"""Steps of brightness in which colours are taken together."""
ENOUGH = 40
"""Pixels that a step must have on average."""
STEEPEST = 0.8
"""Slope of green or blue over red from which on the colour is grey itself, and tells no veil."""


def veil_of(rgb: np.ndarray, spoilt: np.ndarray) -> float:
    """Linear light 0-1 that is added to a recording.

    rgb: sRGB, (T, H, W, 3) uint8. spoilt: pixels that show no tissue of their own, (T, H, W) bool.
    """
    ratio = min(1.0, SIZE / max(rgb.shape[1:3]))
    wide, high = (max(round(n * ratio), 1) for n in rgb.shape[2:0:-1])
    seen = []
    for t in np.unique(np.linspace(0, len(rgb) - 1, FRAMES).astype(int)):
        clear = (~spoilt[t] & (rgb[t].max(-1) < 250) & (rgb[t].max(-1) > 8)).astype(np.float32)
        share = cv2.resize(clear, (wide, high), interpolation=cv2.INTER_AREA)
        mean = cv2.resize(linear_light(rgb[t]) * clear[..., None], (wide, high), interpolation=cv2.INTER_AREA)
        seen.append(mean[share > 0.9] / share[share > 0.9][:, None])
    return veil(np.concatenate(seen))


def veil(light: np.ndarray) -> float:
    """Linear light 0-1 that is added to every channel; 0 where none shows.

    light: of tissue without highlights, linear, red, green, blue, (N, 3).
    """
    if len(light) < BINS * ENOUGH:
        return 0.0
    red = light[:, 0]
    edges = np.quantile(red, np.linspace(0, DARKER, BINS + 1))
    of = np.digitize(red, edges[1:-1])
    of[red > edges[-1]] = BINS
    if np.bincount(of, minlength=BINS + 1)[:BINS].min() == 0:
        return 0.0
    middle = np.array([np.median(light[of == k], axis=0) for k in range(BINS)])
    found = []
    for channel in (1, 2):
        slope, missed = np.polyfit(middle[:, 0], middle[:, channel], 1)
        found.append(missed / (1 - slope) if slope < STEEPEST else 0.0)
    return max(0.0, float(min(found)))
