"""Pictures of a moved body: every splat is carried, turned and stretched by the simulation."""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.scene import Scene
from surgisim.gaussians.attributes import drawn
from surgisim.gaussians.engine_gsplat import lacking
from surgisim.gaussians.rasterise import render_factors, to_bytes
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

    def __init__(self, mean, rotation, scale, opacity, color, simulator: Nodes, device: str = "cpu") -> None:
        """device: where they are drawn; on 'cuda' only where gsplat is there."""
        self.carried, self.opacity, self.color = Carried(mean, simulator), opacity, color
        self.device = "cuda" if device == "cuda" and not lacking() else "cpu"
        turn = Rotation.from_quat(np.asarray(rotation, float), scalar_first=True).as_matrix()
        self.factor = turn * np.asarray(scale, float)[:, None, :]

    def seen(self, u: np.ndarray, camera: Camera, shade: Shade | None) -> tuple[np.ndarray, np.ndarray]:
        """Colour (H, W, 3) and alpha (H, W) at displacements of the solid nodes [m], (A, 3)."""
        mean, F = self.carried.at(u)
        color = self.color if shade is None else shade(mean, F)
        # A splat's covariance M M^T becomes (F M)(F M)^T.
        return render_factors(mean, F @ self.factor, self.opacity, color, camera, device=self.device)


class Drawn:
    """The scene, and behind it, where it opens, the body's interior and what lies beyond the picture's edge."""

    def __init__(
        self, scene: Scene, rim: Scene, body: Body, simulator: Nodes, interior: bool, device: str = "cpu"
    ) -> None:
        """rim: see `gaussians.rim`."""
        front, behind = drawn(scene), drawn(rim)
        if interior:
            behind = [np.concatenate(pair) for pair in zip(behind, _inside(body), strict=True)]
        self.front, self.behind = (Splats(*s, simulator, device) for s in (front, behind))

    def under(self, light: Light | None) -> Callable[[np.ndarray, Camera], np.ndarray]:
        """What a camera sees at displacements of the solid nodes [m], (A, 3), as (H, W, 3) uint8.

        light: None leaves every colour as the rest frame has it.
        """
        shades = [light and light.shade(s.carried.rest, s.color) for s in (self.front, self.behind)]

        def picture(u: np.ndarray, camera: Camera) -> np.ndarray:
            rgb, alpha = self.front.seen(u, camera, shades[0])
            if alpha.min() >= COVERED:
                return to_bytes(rgb)
            gap = np.maximum(0.0, 1 - alpha / COVERED)[..., None]
            return to_bytes(rgb + gap * self.behind.seen(u, camera, shades[1])[0])

        return picture


def _inside(body: Body) -> tuple[np.ndarray, ...]:
    """The particles behind the surface as round splats: mean, rotation, scale, opacity and colour."""
    inside = ~body.surface
    count = int(inside.sum())
    radius = 0.5 * np.cbrt(body.volume[inside].astype(float))
    still = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    return body.rest[inside], still, np.repeat(radius[:, None], 3, 1), np.full(count, 0.95), body.color[inside]
