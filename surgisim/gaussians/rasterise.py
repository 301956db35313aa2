"""One way to see Gaussians, three engines behind it.

numba   CPU, float32, analytic backward; the same bytes whatever the number of threads
gsplat  CUDA, float32
twin    torch, any float type, slow and readable: what the other two are measured against
"""

import math
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np
import torch

from surgisim.artifacts.camera import Camera
from surgisim.problem import Problem

Engine = Literal["numba", "gsplat", "twin"]
NEAR = 1e-3
"""What is closer along z is not drawn [m]."""


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
    near: float = NEAR,
    weigh: bool = True,
    checked: bool = True,
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
    weigh       whether `weight` is asked for: gsplat draws once more for it, and leaves it 0 where it is not
    checked     whether values are looked at first, which waits for all that a GPU still does

    All but the camera may have B in front, for as many sets of Gaussians; the image has it too.

    Raises Problem for shapes that do not fit, values that are not finite, opacities outside 0-1, and a missing
    CUDA engine.
    """
    attributes = {"mean": mean, "rotation": rotation, "scale": scale, "opacity": opacity, "color": color}
    _check(attributes, checked)
    back = (0.0, 0.0, 0.0) if background is None else tuple(float(b) for b in background)
    if engine == "numba":
        from surgisim.gaussians.engine_numba import rasterise as draw
    elif engine == "gsplat":
        from surgisim.gaussians.engine_gsplat import rasterise as draw_on_gpu

        draw = partial(draw_on_gpu, weigh=weigh)
    elif engine == "twin":
        from surgisim.gaussians.twin import rasterise as draw
    else:
        raise Problem(f"rasterise: engine is '{engine}', and there are numba, gsplat and twin.")
    if probe is None and engine != "gsplat":
        probe = mean.new_zeros((*mean.shape[:-1], 2))
    tensors = mean, rotation, scale, opacity, color, probe
    if mean.ndim == 2 or engine == "gsplat":
        return Image(*draw(*tensors, camera, back, near))
    each = [draw(*one, camera, back, near) for one in zip(*tensors, strict=True)]
    return Image(*map(torch.stack, zip(*each, strict=True)))


def engine_on(device: torch.device) -> Engine:
    """The engine that draws what lies on a device."""
    return "gsplat" if device.type == "cuda" else "numba"


def render(
    mean: np.ndarray,
    rotation: np.ndarray,
    scale: np.ndarray,
    opacity: np.ndarray,
    color: np.ndarray,
    camera: Camera,
    *,
    background: tuple[float, float, float] | None = None,
    near: float = NEAR,
    device: str = "cpu",
) -> Image:
    """`rasterise` for numpy arrays, without gradients."""
    there = torch.device(device)
    arrays = (np.ascontiguousarray(a, np.float32) for a in (mean, rotation, scale, opacity, color))
    with torch.no_grad():
        tensors = (torch.from_numpy(a).to(there) for a in arrays)
        seen = rasterise(*tensors, camera, background=background, near=near, engine=engine_on(there))
    return Image(*(a.cpu().numpy() for a in (seen.rgb, seen.depth, seen.alpha, seen.weight)))


def render_factors(
    mean: np.ndarray, factor: np.ndarray, opacity: np.ndarray, color: np.ndarray, camera: Camera, *, device: str = "cpu"
) -> tuple[np.ndarray, np.ndarray]:
    """Colour, sRGB 0-1 on black, (H, W, 3), and alpha, (H, W), of Gaussians with covariances M M^T.

    M is `factor` (G, 3, 3) [m]; the rest as in `rasterise`. Raises Problem for values that are not finite.
    """
    arrays = {"mean": mean, "factor": factor, "opacity": opacity, "color": color}
    for name, array in arrays.items():
        if not np.isfinite(array).all():
            raise Problem(f"rasterise: {name} is not finite for some of {len(mean)} Gaussians.")
    ready = [np.ascontiguousarray(a, np.float32) for a in arrays.values()]
    if device == "cuda":
        from surgisim.gaussians.engine_gsplat import draw_factors
    else:
        from surgisim.gaussians.engine_numba import draw_factors
    return draw_factors(*ready, camera, NEAR)


def to_bytes(rgb: np.ndarray) -> np.ndarray:
    """sRGB 0-1 as 0-255 uint8, colours outside the range cut to it."""
    return np.rint(np.clip(rgb, 0, 1) * 255).astype(np.uint8)


def _check(attributes: dict[str, torch.Tensor], values: bool) -> None:
    *sets, g = attributes["mean"].shape[:-1]
    wanted = {"mean": (3,), "rotation": (4,), "scale": (3,), "opacity": (), "color": (3,)}
    for name, tensor in attributes.items():
        shape = (*sets, g, *wanted[name])
        if tuple(tensor.shape) != shape:
            raise Problem(f"rasterise: {name} has shape {tuple(tensor.shape)}, and {shape} is wanted.")
    if not (g and values):
        return
    given = {name: tensor.detach() for name, tensor in attributes.items()}
    # A sum is not finite as soon as one value is not, and costs a fifth of testing each; all are asked for at once,
    # because a GPU has done nothing else by the time it answers.
    range_of = given["opacity"].aminmax()
    turned = given["rotation"].abs().amax(-1).amin()
    *sums, low, high, turned = torch.stack([*(t.sum() for t in given.values()), *range_of, turned]).tolist()
    for (name, tensor), total in zip(given.items(), sums, strict=True):
        bad = [] if math.isfinite(total) else _bad(tensor, len(sets))
        if len(bad):
            raise Problem(f"rasterise: {name} is not finite for {len(bad)} of {g} Gaussians, first {int(bad[0])}.")
    if low < 0 or high > 1:
        raise Problem(f"rasterise: opacity runs from {low:g} to {high:g}, and 0 to 1 is wanted.")
    if not turned:
        raise Problem("rasterise: a rotation is 0, 0, 0, 0, which turns nothing anywhere.")


def _bad(tensor: torch.Tensor, sets: int) -> torch.Tensor:
    """Which Gaussians have a value that is not finite in any of the sets, (N,)."""
    fine = torch.isfinite(tensor)
    fine = fine.all(0) if sets else fine
    return (~fine.reshape(len(fine), -1).all(1)).nonzero().ravel()
