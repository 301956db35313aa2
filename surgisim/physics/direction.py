"""A direction in tissue at rest, given by two angles."""

import math

from surgisim.physics.catalogue import Numbers, Param


def direction(azimuth: float, elevation: float) -> Numbers:
    """Unit vector in the camera frame: azimuth from x (right) to y (down), elevation toward z (into the tissue)."""
    level = math.cos(elevation)
    return {"ax": level * math.cos(azimuth), "ay": level * math.sin(azimuth), "az": math.sin(elevation)}


def angles(azimuth: float = 0.0, elevation: float = 0.0) -> dict[str, Param]:
    """The two parameters of a law with a direction, and where a fit starts.

    An axis has no sign, so half a turn either way holds every axis twice and a fit never meets a wall.
    """
    turn = math.pi
    return {
        "azimuth": Param("rad", low=-turn, high=turn, default=azimuth, logarithmic=False),
        "elevation": Param("rad", low=-turn, high=turn, default=elevation, logarithmic=False),
    }
