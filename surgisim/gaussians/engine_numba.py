"""The CPU engine: projection, tile lists and blending in Numba, tied to torch's gradients."""

import numpy as np
import torch

from surgisim.artifacts.camera import Camera
from surgisim.gaussians.blending import blend, blend_back, gather
from surgisim.gaussians.projection import Z, project, project_back, project_factors
from surgisim.gaussians.tiles import deal
from surgisim.problem import Problem


def rasterise(
    mean: torch.Tensor,
    rotation: torch.Tensor,
    scale: torch.Tensor,
    opacity: torch.Tensor,
    color: torch.Tensor,
    probe: torch.Tensor,
    camera: Camera,
    background: tuple[float, ...],
    near: float,
) -> tuple[torch.Tensor, ...]:
    """rgb, depth, alpha, weight; see surgisim.gaussians.rasterise."""
    for tensor in (mean, rotation, scale, opacity, color):
        if tensor.dtype != torch.float32 or tensor.device.type != "cpu":
            raise Problem(
                f"rasterise: engine numba wants float32 on the CPU and was given {tensor.dtype} on {tensor.device}."
            )
    return _Rasterise.apply(mean, rotation, scale, opacity, color, probe, camera, background, near)


def draw_factors(
    mean: np.ndarray, factor: np.ndarray, opacity: np.ndarray, color: np.ndarray, camera: Camera, near: float
) -> tuple[np.ndarray, np.ndarray]:
    """Colour, (H, W, 3), and alpha, (H, W), on black, of Gaussians (G, 3) [m] with covariances M M^T, M being `factor`
    (G, 3, 3) [m]; all float32."""
    lens = _lens(camera)
    ellipse, box = np.zeros((len(mean), 10), np.float32), np.empty((len(mean), 4), np.int32)
    project_factors(mean, factor, opacity, color, lens, near, ellipse, box)
    rgb, _, through, *_ = _blended(ellipse, box, np.zeros(3, np.float32), camera)
    return rgb, 1 - through


def _lens(camera: Camera) -> np.ndarray:
    return np.array([camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height], np.float64)


def _blended(ellipse: np.ndarray, box: np.ndarray, back: np.ndarray, camera: Camera) -> tuple:
    """Picture, depth, what shines through, the last entry of each pixel, each entry's weight, and the tiles' lists."""
    size = (camera.height, camera.width)
    start, gaussian, number, first = deal(ellipse[:, Z].copy(), box, camera.width, camera.height)
    rgb, depth = np.empty((*size, 3), np.float32), np.empty(size, np.float32)
    through, last = np.empty(size, np.float32), np.empty(size, np.int32)
    weight = np.zeros((len(gaussian), 1), np.float32)
    blend(ellipse, box, start, gaussian, number, back, rgb, depth, through, last, weight[:, 0])
    return rgb, depth, through, last, weight, (start, gaussian, number, first)


class _Rasterise(torch.autograd.Function):
    @staticmethod
    def forward(ctx, mean, rotation, scale, opacity, color, probe, camera, background, near):
        arrays = [_array(t) for t in (mean, rotation, scale, opacity, color)]
        g, lens, back = len(mean), _lens(camera), np.array(background, np.float32)
        ellipse, box = np.zeros((g, 10), np.float32), np.empty((g, 4), np.int32)
        project(*arrays, lens, near, ellipse, box)
        rgb, depth, through, last, entry_weight, lists = _blended(ellipse, box, back, camera)
        weight = np.empty((g, 1), np.float32)
        gather(lists[-1], entry_weight, weight)
        ctx.save_for_backward(mean, rotation, scale)
        ctx.lists = lens, ellipse, box, *lists, back, through, last
        outputs = rgb, depth, 1 - through, weight[:, 0]
        rgb, depth, alpha, weight = (torch.from_numpy(a) for a in outputs)
        ctx.mark_non_differentiable(weight)
        return rgb, depth, alpha, weight

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx, d_rgb, d_depth, d_alpha, _):
        lens, ellipse, box, start, gaussian, number, first, back, through, last = ctx.lists
        d_entry = np.zeros((len(gaussian), 10), np.float32)
        d_image = [_array(t) for t in (d_rgb, d_depth, d_alpha)]
        blend_back(ellipse, box, start, gaussian, number, back, through, last, *d_image, d_entry)
        d_ellipse = np.empty((len(ellipse), 10), np.float32)
        gather(first, d_entry, d_ellipse)
        mean, rotation, scale = (_array(t) for t in ctx.saved_tensors)
        outputs = [np.empty(shape, np.float32) for shape in (mean.shape, rotation.shape, scale.shape)]
        outputs += [np.empty(len(mean), np.float32), np.empty((len(mean), 3), np.float32)]
        project_back(mean, rotation, scale, lens, box, d_ellipse, *outputs)
        gradients = [torch.from_numpy(a) for a in outputs]
        return *gradients, torch.from_numpy(d_ellipse[:, :2].copy()), None, None, None


def _array(tensor: torch.Tensor) -> np.ndarray:
    return tensor.detach().contiguous().numpy()
