"""Numbers and letters that stand for places, the same in a verdict's words, in its file and on its page."""

from typing import Any

import numpy as np

from surgisim.artifacts.verdict import LARGEST


def markers(verdict: str, effects: list[dict[str, Any]], clip, z: np.ndarray) -> list[dict[str, Any]]:
    """Effects that have a place, by their number from 1, and the largest misfit; none where nothing is detected.

    z: length of the smoothed residual in standard deviations of noise, (K, T).
    """
    if verdict == "nothing detectable":
        return []
    numbered = [
        {"mark": str(number), "of": effect["term"], **effect["place"]}
        for number, effect in enumerate(effects, 1)
        if isinstance(effect["place"], dict)
    ]
    k, t = largest(z, clip.until)
    center, time = [float(c) for c in clip.rest[k]], float(t / clip.fps)
    return [*numbered, {"mark": LARGEST, "of": "largest misfit", "center": center, "unit": "m", "time": time}]


def largest(z: np.ndarray, until: int) -> tuple[int, int]:
    """Point and frame of the largest misfit in the frames before `until`."""
    k, t = np.unravel_index(np.argmax(z[:, :until]), (len(z), until))
    return int(k), int(t)
