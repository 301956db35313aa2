"""What a simulation did: the body at every frame."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.base import Artifact, check


@dataclass(frozen=True)
class Replay(Artifact):
    time: np.ndarray
    """[s], (T,)."""
    position: np.ndarray
    """Particles of body.npz, camera frame [m], (T, P, 3) float32."""
    nodes: np.ndarray
    """Displacement of the grid's nodes [m], (T, N, 3) float32: carries any rest point (mpm.grid)."""
    origin: np.ndarray
    """Corner of the grid, camera frame [m], (3,)."""
    shape: np.ndarray
    """Nodes along x, y, z, (3,) int; N is their product, z fastest."""
    spacing: float
    """[m]"""
    smallest_volume_ratio: np.ndarray
    """Smallest det F of the body, (T,)."""
    energy: np.ndarray
    """Kinetic and elastic energy [J], (T, 2)."""
    rgb: np.ndarray
    """Rendered frames, sRGB, (T, H, W, 3) uint8; first axis 0 if not rendered."""

    UNITS = {"time": "s", "position": "m", "nodes": "m", "origin": "m", "spacing": "m", "energy": "J"}

    def __post_init__(self) -> None:
        t = len(self.time)
        check(
            self.position.shape[::2] == (t, 3) and self.nodes.shape == (t, int(np.prod(self.shape)), 3),
            f"Replay: position {self.position.shape}, nodes {self.nodes.shape} do not fit {t} frames.",
        )
