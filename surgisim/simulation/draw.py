"""Pictures of a moved body: every splat is carried, turned and stretched by the grid."""

import numpy as np
from scipy.spatial.transform import Rotation

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.scene import Scene
from surgisim.gaussians.attributes import drawn
from surgisim.gaussians.rasterise import Image, render, to_bytes
from surgisim.mpm.simulator import Simulator

COVERED = 0.9
"""Opacity of the surface from which nothing behind it shows: the scene was fitted before black."""


class Splats:
    """Gaussians bound to a body's grid."""

    def __init__(self, mean, rotation, scale, opacity, color, simulator: Simulator) -> None:
        self.mean, self.opacity, self.color = np.asarray(mean, float), opacity, color
        turn = Rotation.from_quat(np.asarray(rotation, float), scalar_first=True).as_matrix()
        self.factor = turn * np.asarray(scale, float)[:, None, :]
        self.nodes, self.weight, self.gradient = simulator.stencil(self.mean)

    def seen(self, displacement: np.ndarray, camera: Camera) -> Image:
        """The image at a nodal displacement [m], (N or 2 N, 3)."""
        u = displacement[self.nodes]
        mean = self.mean + np.einsum("qk,qka->qa", self.weight, u)
        F = np.eye(3) + np.einsum("qka,qkb->qab", u, self.gradient)
        # A splat's covariance M M^T becomes (F M)(F M)^T; its axes are the left singular vectors.
        axes, radii, _ = np.linalg.svd(F @ self.factor)
        axes = axes * np.sign(np.linalg.det(axes))[:, None, None]
        rotation = Rotation.from_matrix(axes).as_quat(scalar_first=True)
        return render(mean, rotation, np.maximum(radii, 1e-7), self.opacity, self.color, camera)


class Drawn:
    """The scene, and behind it, where it opens, the body's interior."""

    def __init__(self, scene: Scene, body: Body, simulator: Simulator, interior: bool) -> None:
        self.surface = Splats(*drawn(scene), simulator)
        inside = ~body.surface
        self.interior = None
        if interior and inside.any():
            count = int(inside.sum())
            radius = 0.5 * np.cbrt(body.volume[inside].astype(float))
            still = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
            radii, opacity = np.repeat(radius[:, None], 3, 1), np.full(count, 0.95)
            self.interior = Splats(body.rest[inside], still, radii, opacity, body.color[inside], simulator)

    def picture(self, displacement: np.ndarray, camera: Camera) -> np.ndarray:
        """The frame at a nodal displacement [m], (N or 2 N, 3), as (H, W, 3) uint8."""
        front = self.surface.seen(displacement, camera)
        if self.interior is None or front.alpha.min() >= COVERED:
            return to_bytes(front.rgb)
        behind = self.interior.seen(displacement, camera)
        gap = np.maximum(0.0, 1 - front.alpha / COVERED)[..., None]
        return to_bytes(front.rgb + gap * behind.rgb)
