"""Pictures of a moved body: every splat is carried, turned and stretched by the grid."""

import numpy as np
from scipy.spatial.transform import Rotation

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.scene import Scene
from surgisim.gaussians.attributes import drawn
from surgisim.gaussians.rasterise import render, to_bytes
from surgisim.mpm.simulator import Simulator


class Drawn:
    """The scene's splats with, if wanted, the body's interior behind them, ready to be moved."""

    def __init__(self, scene: Scene, body: Body, simulator: Simulator, interior: bool) -> None:
        mean, rotation, scale, opacity, color = (np.asarray(a, float) for a in drawn(scene))
        if interior:
            inside = ~body.surface
            n = int(inside.sum())
            radius = 0.5 * np.cbrt(body.volume[inside].astype(float))
            mean = np.concatenate([mean, body.rest[inside]])
            rotation = np.concatenate([rotation, np.tile([1.0, 0, 0, 0], (n, 1))])
            scale = np.concatenate([scale, np.repeat(radius[:, None], 3, 1)])
            opacity = np.concatenate([opacity, np.full(n, 0.95)])
            color = np.concatenate([color, body.color[inside]])
        self.mean, self.opacity, self.color = mean, opacity, color
        turn = Rotation.from_quat(rotation[:, [1, 2, 3, 0]]).as_matrix()
        self.factor = turn * scale[:, None, :]
        self.nodes, self.weight, self.gradient = simulator.stencil(mean)

    def picture(self, displacement: np.ndarray, camera: Camera) -> np.ndarray:
        """The frame at a nodal displacement [m], (N or 2 N, 3), as (H, W, 3) uint8."""
        u = displacement[self.nodes]
        mean = self.mean + np.einsum("qk,qka->qa", self.weight, u)
        F = np.eye(3) + np.einsum("qka,qkb->qab", u, self.gradient)
        # A splat's covariance M M^T becomes (F M)(F M)^T; its axes are the left singular vectors.
        axes, radii, _ = np.linalg.svd(F @ self.factor)
        axes = axes * np.sign(np.linalg.det(axes))[:, None, None]
        rotation = Rotation.from_matrix(axes).as_quat()[:, [3, 0, 1, 2]]
        return to_bytes(render(mean, rotation, np.maximum(radii, 1e-7), self.opacity, self.color, camera).rgb)
