"""What holds the body: how deep the tissue gives way, and whether its rim is attached.

A camera sees neither. A load spreads wider over thicker tissue and stops at an attached rim, so the tracks of a pull
and its hold tell; left out, Poisson's ratio and the modulus are bent to make up for a wrong one. The depth is a number
of the fit, begun from a few; the rim is one of two.
"""

from dataclasses import dataclass

import numpy as np

from surgisim.estimation.lay import Columns
from surgisim.estimation.unknown import Unknown

SHARES = (1.0, 0.65, 0.4)
"""Depths the fit may begin from, as shares of the thickened body's."""
LEAST, MOST = 1.0, 1.2
"""The shallowest depth, in grid cells, and the greatest, as a share of the thickened body's."""
MIDDLE, SPREAD = 0.5, 0.6
"""What is expected of the depth, as a share of the thickened body's, and the spread of its logarithm."""


@dataclass(frozen=True)
class Support:
    """One way the body may be held."""

    depth: float
    """Of the layer that is held, below the surface [m]."""
    rim: bool
    """Whether the rim is held."""


def supports(columns: Columns) -> list[Support]:
    """The body as it was thickened first, then the others."""
    rims = (True, False) if columns.rim.any() else (False,)
    return [Support(share * columns.thickness, rim) for share in SHARES for rim in rims]


def open_depth(columns: Columns) -> Unknown:
    """The depth at which tissue is held as a number of the fit."""
    least = LEAST * columns.spacing
    middle = MIDDLE * columns.thickness
    ends = min(np.log(least / middle), -SPREAD), np.log(MOST / MIDDLE)
    return Unknown("held.depth", 0.0, SPREAD, *ends, "m", True, middle)
