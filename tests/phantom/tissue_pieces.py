"""Small pieces of tissue to hold the phantom's engine against theory."""

import numpy as np

from surgisim.config.phantom import Phantom
from surgisim.phantom.block import Grip, Shape
from surgisim.phantom.elements import CORNERS

SMALL = Phantom(
    width=96, height=80, duration=0.8, load=0.16, hold=0.36, release=0.44, spacing=0.004, points=120, noise=0.0
)


def box(counts, size):
    """A regular box of hexahedra: nodes (N, 3) and cells (M, 8)."""
    axes = [np.linspace(0, s, n + 1) for s, n in zip(size, counts, strict=True)]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
    index = np.arange(x.size).reshape(x.shape)
    corner = ((CORNERS + 1) // 2).astype(int)
    n, m, k = counts
    cells = np.stack([index[c : c + k, b : b + m, a : a + n].ravel() for a, b, c in corner], -1)
    return np.stack([x, y, z], -1).reshape(-1, 3), cells


def slab(thickness=0.014, half=0.018, waves=None):
    """Shape and grip of a small piece seen from straight above."""
    waves = np.zeros((1, 4)) if waves is None else waves
    shape = Shape(np.array([0, 0, 0.07]), np.eye(3), np.full(2, -half), np.full(2, half), thickness, waves)
    return shape, Grip(np.array([0.0012, -0.0007]), 0.005)
