"""One way to see Gaussians, three engines behind it.

numba   CPU, float32, analytic backward; the same bytes whatever the number of threads
gsplat  CUDA, float32
twin    torch, any float type, slow and readable: what the other two are measured against
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import torch

from surgisim.artifacts.camera import Camera
from surgisim.problem import Problem

Engine = Literal["numba", "gsplat", "twin"]


@dataclass(frozen=True)
class Image:
    """What a camera sees of the Gaussians; torch tensors, or numpy arrays from `render`."""

    rgb: Any
    """Colour, sRGB 0-1, (H, W, 3)."""
    depth: Any
    """sum w z, not divided by alpha [m], (H, W)."""
    alpha: Any
    """sum w, 0-1, (H, W)."""
    weight: Any
    """Sum of w over all pixels, what each Gaussian adds to the image [px], (G,); carries no gradient."""


def rasterise(
    mean: torch.Tensor,
    rotation: torch.Tensor,
    scale: torch.Tensor,
    opacity: torch.Tensor,
    color: torch.Tensor,
    camera: Camera,
    *,
    background: tuple[float, float, float] | None = None,
    engine: Engine = "numba",
    probe: torch.Tensor | None = None,
    near: float = 1e-3,
) -> Image:
    """The image of the Gaussians, with gradients for their five attributes from rgb, depth and alpha.

    mean        centres, camera frame [m], (G, 3)
    rotation    quaternions w, x, y, z of any length but 0, (G, 4)
    scale       radii [m], (G, 3)
    opacity     0-1, (G,)
    color       sRGB 0-1, (G, 3)
    background  sRGB 0-1 behind everything; black if None
    probe       zeros (G, 2) that want a gradient; after backward they hold that of the projected centres [1/px]
    near        what is closer along z is not drawn [m]

    Raises Problem for shapes that do not fit, values that are not finite, opacities outside 0-1, and a missing
    CUDA engine.
    """
    attributes = {"mean": mean, "rotation": rotation, "scale": scale, "opacity": opacity, "color": color}
    _check(attributes)
    back = (0.0, 0.0, 0.0) if background is None else tuple(float(b) for b in background)
    if probe is None:
        probe = mean.new_zeros((len(mean), 2))
    if engine == "numba":
        from surgisim.gaussians.engine_numba import rasterise as draw
    elif engine == "gsplat":
        from surgisim.gaussians.engine_gsplat import rasterise as draw
    elif engine == "twin":
        from surgisim.gaussians.twin import rasterise as draw
    else:
        raise Problem(f"rasterise: engine is '{engine}', and there are numba, gsplat and twin.")
    return Image(*draw(mean, rotation, scale, opacity, color, probe, camera, back, near))


def render(
    mean: np.ndarray,
    rotation: np.ndarray,
    scale: np.ndarray,
    opacity: np.ndarray,
    color: np.ndarray,
    camera: Camera,
    *,
    background: tuple[float, float, float] | None = None,
    near: float = 1e-3,
) -> Image:
    """`rasterise` on the CPU for numpy arrays, without gradients."""
    arrays = (np.ascontiguousarray(a, np.float32) for a in (mean, rotation, scale, opacity, color))
    with torch.no_grad():
        seen = rasterise(*(torch.from_numpy(a) for a in arrays), camera, background=background, near=near)
    return Image(seen.rgb.numpy(), seen.depth.numpy(), seen.alpha.numpy(), seen.weight.numpy())


def to_bytes(rgb: np.ndarray) -> np.ndarray:
    """sRGB 0-1 as 0-255 uint8, colours outside the range cut to it."""
    return np.rint(np.clip(rgb, 0, 1) * 255).astype(np.uint8)


def _check(attributes: dict[str, torch.Tensor]) -> None:
    g = len(attributes["mean"])
    wanted = {"mean": (g, 3), "rotation": (g, 4), "scale": (g, 3), "opacity": (g,), "color": (g, 3)}
    for name, tensor in attributes.items():
        if tuple(tensor.shape) != wanted[name]:
            raise Problem(f"rasterise: {name} has shape {tuple(tensor.shape)}, and {wanted[name]} is wanted.")
        # A sum is not finite as soon as one value is not, and costs a fifth of testing each.
        if not torch.isfinite(tensor.detach().sum()):
            bad = (~torch.isfinite(tensor.detach()).reshape(g, -1).all(1)).nonzero().ravel()
            if len(bad):
                raise Problem(f"rasterise: {name} is not finite for {len(bad)} of {g} Gaussians, first {int(bad[0])}.")
    if g:
        low, high = (float(v) for v in attributes["opacity"].detach().aminmax())
        if low < 0 or high > 1:
            raise Problem(f"rasterise: opacity runs from {low:g} to {high:g}, and 0 to 1 is wanted.")
        if not bool(attributes["rotation"].detach().abs().amax(1).all()):
            raise Problem("rasterise: a rotation is 0, 0, 0, 0, which turns nothing anywhere.")
