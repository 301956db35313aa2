"""Where something points: two angles, as a camera would turn to look along it."""

import math

import numpy as np

YAW, PITCH = (-math.pi, math.pi), (-math.pi / 2, math.pi / 2)
"""Ranges of the two angles [rad]."""


def heading(yaw: float, pitch: float) -> tuple[float, float, float]:
    """Unit vector in the camera frame: straight away (z), turned right (x) by yaw and down (y) by pitch.

    Angles [rad]. Every direction but straight up and down in the image has angles of its own.
    """
    return math.cos(pitch) * math.sin(yaw), math.sin(pitch), math.cos(pitch) * math.cos(yaw)


def across_of(yaw: float, pitch: float) -> tuple[np.ndarray, np.ndarray]:
    """The right of a heading, and what is at right angles to both, (3,) each."""
    right = np.array([math.cos(yaw), 0.0, -math.sin(yaw)])
    return right, np.cross(heading(yaw, pitch), right)
