"""A highlight stays where the wet surface mirrors the lamp; it does not ride on the tissue.

Where the rest frame shows a highlight, some facet there mirrors the lamp into the camera: its normal points at the
camera. As the surface turns by the deformation, or is carried to where the camera lies in another direction, the
facet turns out of the mirror's direction by the angle delta and the highlight fades as a lobe cos(delta)^n, with the
light's fall over distance (Blinn, Models of light reflection for computer synthesized pictures, 1977).
"""

import numpy as np

from surgisim.lighting.headlight import facing
from surgisim.lighting.normals import turned
from surgisim.perception.tracking.spread import spread

LOBES = (0.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0)
"""Exponents to choose from: 0 rides on the tissue, 1000 has lost half at 2 degrees [1]."""


def without(light: np.ndarray, glint: np.ndarray) -> np.ndarray:
    """Linear light (H, W, 3) with the pixels of `glint` (H, W) bool filled from around."""
    return np.where(glint[..., None], spread(light, (~glint).astype(np.float32)), light)


def share_left(rest: np.ndarray, moved: np.ndarray, F: np.ndarray, lobe: float) -> np.ndarray:
    """Share of a highlight's light that is left, (Q,), 1 without motion.

    rest, moved: positions, camera frame [m], (Q, 3); F: deformation gradient there, (Q, 3, 3); lobe: exponent.
    """
    mirror = np.maximum(facing(moved, turned(F, -rest)), 0.0)
    nearer = (rest**2).sum(-1) / (moved**2).sum(-1)
    return mirror**lobe * nearer
