"""The CUDA engine: gsplat behind the interface of `rasterise`.

Ye et al., gsplat: an open-source library for Gaussian splatting, JMLR 26 (2025). It differs from the other engines
in three small ways: pixel centres lie at halves (shifted here), alpha is held at 0.999 instead of 0.99, and the
Gaussian that would bring T below 1e-4 is left out. It builds its kernels with nvcc when first used (minutes).
"""

import importlib.util
import shutil
from functools import cache, lru_cache

import numpy as np
import torch

from surgisim.artifacts.camera import Camera
from surgisim.gaussians.projection import LOW_PASS
from surgisim.gaussians.rasterise import NEAR
from surgisim.problem import Problem

UPRIGHT = tuple(tuple(float(i == j) for j in range(4)) for i in range(4))
"""The camera's pose: its frame is the world's."""


def rasterise(
    mean: torch.Tensor,
    rotation: torch.Tensor,
    scale: torch.Tensor,
    opacity: torch.Tensor,
    color: torch.Tensor,
    probe: torch.Tensor | None,
    camera: Camera,
    background: tuple[float, ...],
    near: float,
    weigh: bool = True,
) -> tuple[torch.Tensor, ...]:
    """rgb, depth, alpha, weight; see surgisim.gaussians.rasterise. Several sets of Gaussians, (B, G, ...), are drawn at
    once."""
    missing = lacking()
    if missing:
        raise Problem(f"rasterise: engine gsplat needs {missing}, which this machine lacks. Use engine numba.")
    for tensor in (mean, rotation, scale, opacity, color):
        if tensor.dtype != torch.float32 or tensor.device.type != "cuda":
            raise Problem(
                f"rasterise: engine gsplat wants float32 on a CUDA device and was given {tensor.dtype} on "
                f"{tensor.device}."
            )
    if mean.shape[-2] == 0:
        # gsplat's kernels end the process when there is nothing to draw.
        nothing = mean.new_zeros(*mean.shape[:-2], camera.height, camera.width) + color.sum()
        return nothing[..., None] + mean.new_tensor(background), nothing, nothing, mean.new_zeros(mean.shape[:-1])
    attributes = mean, rotation, scale, opacity
    image, alpha, facts = _draw(*attributes, color, camera, background, near, "RGB+D")
    if probe is not None and probe.requires_grad and facts["means2d"].requires_grad:
        facts["means2d"].register_hook(lambda gradient: _add_gradient(probe, gradient.reshape(probe.shape)))
    # One zero for all, which is on the device already: making as many as there are Gaussians costs a launch.
    none = _constant((0.0,), mean.device)
    weight = _weight(*attributes, camera, near) if weigh else none.expand(mean.shape[:-1])
    return image[..., :3], image[..., 3], alpha, weight


def draw_covariances(
    mean: torch.Tensor, covariance: torch.Tensor, opacity: torch.Tensor, color: torch.Tensor, camera: Camera,
    near: float = NEAR,
) -> tuple[torch.Tensor, torch.Tensor]:  # fmt: skip
    """Colour, (H, W, 3), and alpha, (H, W), of Gaussians (G, 3) [m] with covariances (G, 3, 3) [m^2]; all float32 on
    the CUDA device."""
    from gsplat import rasterization

    with torch.no_grad():
        image, alpha, _ = rasterization(
            mean, None, None, opacity, color, *_views(camera, mean.device), camera.width, camera.height,
            near_plane=near, eps2d=LOW_PASS, packed=False, covars=covariance,
        )  # fmt: skip
    return image[0], alpha[0, ..., 0]


def draw_factors(
    mean: np.ndarray, factor: np.ndarray, opacity: np.ndarray, color: np.ndarray, camera: Camera, near: float
) -> tuple[np.ndarray, np.ndarray]:
    """As engine_numba's, drawn on the CUDA device."""
    if len(mean) == 0:
        # As in `rasterise`.
        empty = np.zeros((camera.height, camera.width), np.float32)
        return np.repeat(empty[..., None], 3, 2), empty
    place, factor, opacity, color = (torch.as_tensor(a, device="cuda") for a in (mean, factor, opacity, color))
    rgb, alpha = draw_covariances(place, factor @ factor.mT, opacity, color, camera, near)
    return rgb.cpu().numpy(), alpha.cpu().numpy()


@cache
def lacking() -> str:
    """What the engine misses on this machine, in words; empty when it can run. Looked for once, not at each picture."""
    if not torch.cuda.is_available():
        return "a CUDA device"
    if importlib.util.find_spec("gsplat") is None:
        return "the package gsplat (surgisim's extra 'cuda')"
    from torch.utils.cpp_extension import CUDA_HOME

    built = importlib.util.find_spec("gsplat.csrc") is not None
    if not built and CUDA_HOME is None and shutil.which("nvcc") is None:
        return "nvcc, the CUDA compiler that gsplat builds its kernels with"
    return ""


def _draw(mean, rotation, scale, opacity, color, camera, background, near, mode):
    from gsplat import rasterization

    sets = mean.shape[:-2]
    view, lens = (a.expand(*sets, *a.shape) for a in _views(camera, mean.device))
    # Black is what gsplat draws on by itself, with less to do.
    behind = _constant((background,), mean.device).expand(*sets, 1, len(background)) if any(background) else None
    image, alpha, facts = rasterization(
        mean,
        rotation,
        scale,
        opacity,
        color,
        view,
        lens,
        camera.width,
        camera.height,
        near_plane=near,
        eps2d=LOW_PASS,
        packed=False,
        backgrounds=behind,
        render_mode=mode,
    )
    # One camera, before height, width and channels.
    return image[..., 0, :, :, :], alpha[..., 0, :, :, 0], facts


def _views(camera: Camera, device: torch.device) -> tuple[torch.Tensor, torch.Tensor]:
    """The camera's pose and lens as gsplat wants them, (1, 4, 4) and (1, 3, 3): pixel centres lie at halves there."""
    lens = (camera.fx, 0.0, camera.cx + 0.5), (0.0, camera.fy, camera.cy + 0.5), (0.0, 0.0, 1.0)
    return _constant((UPRIGHT,), device), _constant((lens,), device)


@lru_cache(maxsize=64)
def _constant(numbers: tuple, device: torch.device) -> torch.Tensor:
    """These numbers on the device, brought there once: bringing any there waits for all that the device still does."""
    return torch.tensor(numbers, dtype=torch.float32, device=device)


def _weight(mean, rotation, scale, opacity, camera, near):
    """Sum of w over all pixels: the gradient of a picture of ones with respect to their colour."""
    with torch.enable_grad():
        one = torch.ones_like(mean[..., :1], requires_grad=True)
        fixed = (t.detach() for t in (mean, rotation, scale, opacity))
        image, _, _ = _draw(*fixed, one, camera, (0.0,), near, "RGB")
        (weight,) = torch.autograd.grad(image.sum(), one)
    return weight[..., 0]


def _add_gradient(probe, gradient):
    probe.grad = gradient.clone() if probe.grad is None else probe.grad + gradient
