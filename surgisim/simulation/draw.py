"""Pictures of a moved body: every splat is carried, turned and stretched by the simulation."""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.scene import Scene
from surgisim.gaussians.attributes import drawn
from surgisim.gaussians.engine_gsplat import lacking, render_covariances
from surgisim.gaussians.rasterise import Image, render, to_bytes
from surgisim.mpm.carried import Carried
from surgisim.mpm.nodes import Nodes

COVERED = 0.9
"""Opacity of the surface from which nothing behind it shows: the scene was fitted before black."""
Shade = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Colours, sRGB (G, 3), of splats at moved means [m], (G, 3), with deformation gradients (G, 3, 3)."""


class Light(Protocol):
    """What lights the splats."""

    def shade(self, rest: np.ndarray, color: np.ndarray) -> Shade:
        """How splats at rest [m], (G, 3), of a colour, sRGB (G, 3), look once they are moved."""


class Splats:
    """Gaussians bound to a body."""

    def __init__(
        self, mean, rotation, scale, opacity, color, simulator: Nodes, shade: Shade | None = None, device: str = "cpu"
    ) -> None:
        """device: where they are drawn; on 'cuda' only where gsplat is there."""
        self.carried, self.opacity, self.color, self.shade = Carried(mean, simulator), opacity, color, shade
        self.on_gpu = device == "cuda" and not lacking()
        turn = Rotation.from_quat(np.asarray(rotation, float), scalar_first=True).as_matrix()
        self.factor = turn * np.asarray(scale, float)[:, None, :]

    def seen(self, u: np.ndarray, camera: Camera) -> Image:
        """The image at displacements of the solid nodes [m], (A, 3)."""
        mean, F = self.carried.at(u)
        color = self.color if self.shade is None else self.shade(mean, F)
        # A splat's covariance M M^T becomes (F M)(F M)^T.
        factor = F @ self.factor
        if self.on_gpu:
            return render_covariances(mean, factor @ factor.transpose(0, 2, 1), self.opacity, color, camera)
        # Its axes are the left singular vectors.
        axes, radii, _ = np.linalg.svd(factor)
        axes = axes * np.sign(np.linalg.det(axes))[:, None, None]
        rotation = Rotation.from_matrix(axes).as_quat(scalar_first=True)
        return render(mean, rotation, np.maximum(radii, 1e-7), self.opacity, color, camera)


class Drawn:
    """The scene, and behind it, where it opens, the body's interior and what lies beyond the picture's edge."""

    def __init__(
        self, scene: Scene, rim: Scene, body: Body, simulator: Nodes, interior: bool, light: Light | None = None,
        device: str = "cpu",
    ) -> None:  # fmt: skip
        """rim: see `gaussians.rim`; light: None leaves every colour as the rest frame has it."""
        shade = (lambda mean, color: None) if light is None else light.shade
        front, behind = drawn(scene), drawn(rim)
        if interior:
            behind = [np.concatenate(pair) for pair in zip(behind, _inside(body), strict=True)]
        self.front, self.behind = (Splats(*s, simulator, shade(s[0], s[-1]), device) for s in (front, behind))

    def picture(self, u: np.ndarray, camera: Camera) -> np.ndarray:
        """The frame at displacements of the solid nodes [m], (A, 3), as (H, W, 3) uint8."""
        front = self.front.seen(u, camera)
        if front.alpha.min() >= COVERED:
            return to_bytes(front.rgb)
        gap = np.maximum(0.0, 1 - front.alpha / COVERED)[..., None]
        return to_bytes(front.rgb + gap * self.behind.seen(u, camera).rgb)


def _inside(body: Body) -> tuple[np.ndarray, ...]:
    """The particles behind the surface as round splats: mean, rotation, scale, opacity and colour."""
    inside = ~body.surface
    count = int(inside.sum())
    radius = 0.5 * np.cbrt(body.volume[inside].astype(float))
    still = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    return body.rest[inside], still, np.repeat(radius[:, None], 3, 1), np.full(count, 0.95), body.color[inside]
