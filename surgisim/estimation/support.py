"""What holds the body: how deep the tissue gives way, how far it goes on beyond the picture, and what holds it there.

A camera sees neither. A load spreads wider over thicker tissue and stops where that ends or is attached, so the tracks
of a pull and its hold tell; left out, Poisson's ratio and the modulus are bent to make up for a wrong one. The depth is
a number of the fit, begun from a few; the edge is one of a few.
"""

from dataclasses import dataclass

import numpy as np

from surgisim.estimation.lay import Columns
from surgisim.estimation.unknown import RELAID, Unknown

SHARES = (0.7, 0.45, 0.3)
"""Depths the fit may begin from, as shares of the thickened body's."""
LEAST, MOST = 1.0, 1.2
"""The shallowest depth, in grid cells, and the greatest, as a share of the thickened body's."""
MIDDLE, SPREAD = 0.5, 0.6
"""What is expected of the depth, as a share of the thickened body's, and the spread of its logarithm."""


@dataclass(frozen=True)
class Edge:
    """Where the body ends around what is seen."""

    beyond: float
    """How far it goes on there, as a share of the depth that is expected [1]."""
    rim: bool
    """Whether it is held where it ends."""

    def margin(self, depth: Unknown, spacing: float) -> float:
        """How far beyond what is seen [m]: whole cells of the grid, so that a finer one has the same end."""
        cells = self.beyond * depth.size / spacing
        return max(1, round(cells)) * spacing if self.beyond else 0.0


EDGES = (Edge(0.35, False), Edge(0.35, True), Edge(0.8, False), Edge(0.0, False), Edge(0.0, True))
"""What is tried, the most expected first: tissue does not end where a picture does."""


def edges_of(depth: Unknown, spacing: float) -> list[tuple[float, bool]]:
    """How far beyond what is seen a body goes [m] and whether it is held there, for each of EDGES.

    Two margins may be as many cells of the grid: then they are one.
    """
    return list(dict.fromkeys((edge.margin(depth, spacing), edge.rim) for edge in EDGES))


@dataclass(frozen=True)
class Support:
    """How the body is held."""

    depth: float
    """Of the layer that is held, below the surface [m]."""
    beyond: float
    """How far the tissue goes on beyond what is seen [m]."""
    rim: bool
    """Whether it is held where it ends there."""
    patches: int = 0
    """Of the edge of what is seen that go as they are seen to."""
    loose: float = 0.0
    """Share of what is seen that only the grip and what it hangs on hold."""
    torn: bool = False
    """Whether that is parted from what it is seen to slide past."""


def open_depth(columns: Columns) -> Unknown:
    """The depth at which tissue is held as a number of the fit."""
    middle = MIDDLE * columns.thickness
    low = min(np.log(LEAST * columns.spacing / middle), -SPREAD)
    return Unknown("held.depth", 0.0, SPREAD, low, np.log(MOST / MIDDLE), "m", True, middle, difference=RELAID)
