"""What holds the body: how deep the tissue gives way, and whether its rim is attached.

A camera sees neither. A load spreads wider over thicker tissue and stops at an attached rim, so the
tracks of a pull and its hold can choose between a few supports; left out, Poisson's ratio and the
modulus are bent to make up for a wrong one.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera

SHARES = (1.0, 0.65, 0.4)
"""Depths tried for the layer that is held, as shares of the thickened body's."""


@dataclass(frozen=True)
class Support:
    """One way the body may be held."""

    depth: float
    """Of the layer that is held, below the surface [m]."""
    rim: bool
    """Whether the rim is held."""
    held: np.ndarray
    """(P,) bool"""


def supports(body: Body, camera: Camera) -> list[Support]:
    """The body's own support first, then the others."""
    top = np.flatnonzero(body.surface)
    if not len(top):
        return [Support(float(np.ptp(body.rest[:, 2])), True, body.held)]
    column = cKDTree(camera.project(body.rest[top])).query(camera.project(body.rest))[1]
    depth = body.rest[:, 2] - body.rest[top][column, 2]
    at_rim = body.held[top][column]
    thickness = float(np.percentile(depth[body.held & ~at_rim], 50)) if (body.held & ~at_rim).any() else depth.max()
    found = []
    for share in SHARES:
        base = body.held & ~at_rim | (depth >= share * thickness)
        for rim in (True, False):
            # The shallowest layer must leave tissue that can move.
            if (~base).sum() > 0.1 * len(base) and not (rim and not at_rim.any()):
                found.append(Support(share * thickness, rim, base | at_rim if rim else base & (depth > 0)))
    return found or [Support(thickness, True, body.held)]
