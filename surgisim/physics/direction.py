"""Directions by two angles, as a camera would turn to look along them."""

import math

YAW, PITCH = (-math.pi, math.pi), (-math.pi / 2, math.pi / 2)
"""Ranges of the two angles [rad]."""


def direction(yaw: float, pitch: float) -> tuple[float, float, float]:
    """Unit vector in the camera frame: straight away (z), turned right (x) by yaw and down (y) by pitch.

    Angles [rad]. Every direction but straight up and down in the image has angles of its own.
    """
    return math.cos(pitch) * math.sin(yaw), math.sin(pitch), math.cos(pitch) * math.cos(yaw)
