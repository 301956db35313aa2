"""A grasper: a shaft through a port, a wrist and two jaws that open, close, pull and let go."""

from dataclasses import dataclass

import numpy as np
from numba import njit

STEPS = 48
"""Sphere-tracing steps per ray at most."""


@dataclass(frozen=True)
class Grasper:
    port: np.ndarray
    """The point of the body wall that the shaft turns about, camera frame [m], (3,)."""
    shaft_radius: float
    """[m]."""
    jaw_length: float
    """Hinge to tip [m]."""
    roll: float
    """Of the plane in which the jaws open, about the shaft [rad]."""


SHAFT, WRIST, JAW = 0, 1, 2


def pose(tool: Grasper, tip: np.ndarray, gape: float) -> np.ndarray:
    """Round cones of the tool with its closed jaws' tip at `tip` [m] and the jaws `gape` [rad] apart.

    (K, 9): two ends [m], their radii [m], and what it is a part of.
    """
    along = tip - tool.port
    along /= np.linalg.norm(along)
    side = np.cross(along, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    side = np.cos(tool.roll) * side + np.sin(tool.roll) * np.cross(along, side)
    hinge = tip - tool.jaw_length * along
    r = tool.shaft_radius
    cones = [
        (hinge - 2.2 * r * along, tool.port, 1.0 * r, 1.0 * r, SHAFT),
        (hinge, hinge - 2.2 * r * along, 0.72 * r, 0.8 * r, WRIST),
    ]
    for sign in (-1, 1):
        out = np.cos(gape / 2) * along + sign * np.sin(gape / 2) * side
        # Bowed like a dissector's, so that light shows between closed jaws.
        bow = hinge + 0.45 * tool.jaw_length * out + sign * 0.07 * tool.jaw_length * side
        end = hinge + tool.jaw_length * out
        cones += [(hinge, bow, 0.58 * r, 0.46 * r, JAW), (bow, end, 0.46 * r, 0.30 * r, JAW)]
    return np.array([[*a, *b, ra, rb, part] for a, b, ra, rb, part in cones])


def cast(cones: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Where rays from the origin through `rays` (z = 1), (R, 3), meet the tool.

    Depth [m] (inf where they miss), (R,); outward normal, (R, 3); the part, (R,); the distance from the
    cone's first end [m], (R,).
    """
    count = len(rays)
    depth, part, station = np.full(count, np.inf), np.full(count, -1), np.zeros(count)
    normal = np.zeros((count, 3))
    _trace(cones, np.ascontiguousarray(rays), depth, normal, part, station)
    return depth, normal, part, station


@njit(cache=True)
def _trace(cones, rays, depth, normal, part, station):
    for n in range(len(rays)):
        x, y = rays[n, 0], rays[n, 1]
        length = np.sqrt(x * x + y * y + 1.0)
        for k in range(len(cones)):
            z = _meet(cones[k], x / length, y / length, 1.0 / length, depth[n] * length) / length
            if z < depth[n]:
                depth[n] = z
                part[n] = int(cones[k, 8])
                h, _ = _nearest(cones[k], z * x, z * y, z)
                length2 = size = 0.0
                for i, at in enumerate((z * x, z * y, z)):
                    axis = cones[k, 3 + i] - cones[k, i]
                    normal[n, i] = at - cones[k, i] - h * axis
                    length2 += axis * axis
                    size += normal[n, i] ** 2
                for i in range(3):
                    normal[n, i] /= np.sqrt(size)
                station[n] = h * np.sqrt(length2)


@njit(cache=True)
def _meet(cone, dx, dy, dz, limit):
    """Distance along the ray from the origin to the cone's skin, inf if it misses or lies beyond `limit`."""
    # A ball around the cone settles most rays.
    cx, cy, cz = (cone[0] + cone[3]) / 2, (cone[1] + cone[4]) / 2, (cone[2] + cone[5]) / 2
    half = np.sqrt((cone[3] - cone[0]) ** 2 + (cone[4] - cone[1]) ** 2 + (cone[5] - cone[2]) ** 2) / 2
    ball = half + max(cone[6], cone[7])
    middle = cx * dx + cy * dy + cz * dz
    miss = cx * cx + cy * cy + cz * cz - middle * middle
    if miss > ball * ball:
        return np.inf
    t = max(middle - np.sqrt(ball * ball - miss), 0.0)
    for _ in range(STEPS):
        _, gap = _nearest(cone, t * dx, t * dy, t * dz)
        if gap < 1e-6:
            return t
        t += gap
        if t > limit or t > middle + ball:
            return np.inf
    return np.inf


@njit(cache=True)
def _nearest(cone, x, y, z):
    """Fraction along the axis nearest to a point, and a lower bound of its distance to the skin [m]."""
    ax, ay, az = cone[3] - cone[0], cone[4] - cone[1], cone[5] - cone[2]
    px, py, pz = x - cone[0], y - cone[1], z - cone[2]
    length2 = ax * ax + ay * ay + az * az
    h = min(max((px * ax + py * ay + pz * az) / length2, 0.0), 1.0)
    ox, oy, oz = px - h * ax, py - h * ay, pz - h * az
    gap = np.sqrt(ox * ox + oy * oy + oz * oz) - (cone[6] + h * (cone[7] - cone[6]))
    taper = (cone[7] - cone[6]) ** 2 / length2
    return h, gap / np.sqrt(1.0 + taper)
