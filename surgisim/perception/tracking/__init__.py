"""Following points of the tissue's surface through a recording. One file per backend.

A backend is a module with

    track(rgb, tool, specular, queries, *, settings, progress) -> Paths

and its name here is its name in the config: `flow_chain` (needs no weights), `cotracker` (a network by path).
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Paths:
    """Where K points of frame 0 went in the image."""

    xy: np.ndarray
    """[px], (K, T, 2) float32; a best guess where not visible."""
    visible: np.ndarray
    """(K, T) bool."""
    sigma: np.ndarray
    """Standard deviation of each coordinate [px], (K, T) float32."""
