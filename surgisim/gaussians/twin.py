"""The rasteriser as its equations read, in torch: every Gaussian at every pixel, gradients by autograd.

For tests and for nothing else: memory and time grow with Gaussians times pixels. The equations are those of
`projection` and `blending`.
"""

import math

import torch

from surgisim.artifacts.camera import Camera
from surgisim.gaussians.projection import ALPHA_MAX, ALPHA_MIN, LOW_PASS

T_MIN = 1e-4


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
    drawn = mean[:, 2] >= near
    safe = torch.where(drawn[:, None], mean, mean.new_tensor([0.0, 0.0, 1.0]))
    center = torch.stack([camera.fx * safe[:, 0], camera.fy * safe[:, 1]], 1) / safe[:, 2:]
    center = center + center.new_tensor([camera.cx, camera.cy]) + probe
    conic = torch.linalg.inv(covariance(safe, rotation, scale, camera))

    y, x = torch.meshgrid(torch.arange(camera.height), torch.arange(camera.width), indexing="ij")
    pixels = torch.stack([x, y], -1).reshape(-1, 1, 2).to(mean)
    order = torch.argsort(safe[:, 2], stable=True)
    offset = pixels - center[order]
    sigma = 0.5 * torch.einsum("pgi,gij,pgj->pg", offset, conic[order], offset)
    alpha = (opacity[order] * torch.exp(-sigma)).clamp(max=ALPHA_MAX)
    alpha = torch.where((alpha >= ALPHA_MIN) & drawn[order], alpha, 0)
    before = torch.cumprod(torch.cat([torch.ones_like(alpha[:, :1]), 1 - alpha], 1), 1)
    alpha = torch.where(before[:, :-1] >= T_MIN, alpha, 0)
    through = torch.cumprod(torch.cat([torch.ones_like(alpha[:, :1]), 1 - alpha], 1), 1)
    w = alpha * through[:, :-1]

    size = (camera.height, camera.width)
    rgb = w @ color[order] + through[:, -1:] * color.new_tensor(background)
    weight = torch.zeros_like(opacity).index_add(0, order, w.sum(0)).detach()
    return rgb.reshape(*size, 3), (w @ safe[order, 2]).reshape(size), (1 - through[:, -1]).reshape(size), weight


def covariance(mean: torch.Tensor, rotation: torch.Tensor, scale: torch.Tensor, camera: Camera) -> torch.Tensor:
    """J R S S^T R^T J^T + 0.3 I [px^2], (G, 2, 2)."""
    z = mean[:, 2]
    half_x, half_y = 0.15 * camera.width, 0.15 * camera.height
    u = (mean[:, 0] / z).clamp(-(camera.cx + half_x) / camera.fx, (camera.width - camera.cx + half_x) / camera.fx)
    v = (mean[:, 1] / z).clamp(-(camera.cy + half_y) / camera.fy, (camera.height - camera.cy + half_y) / camera.fy)
    zero = torch.zeros_like(z)
    J = torch.stack([camera.fx / z, zero, -camera.fx * u / z, zero, camera.fy / z, -camera.fy * v / z], -1)
    V = J.reshape(-1, 2, 3) @ (matrix(rotation) * scale[:, None, :])
    return V @ V.mT + LOW_PASS * torch.eye(2).to(V)


def matrix(rotation: torch.Tensor) -> torch.Tensor:
    """Rotation matrices, (G, 3, 3), of quaternions w, x, y, z of any length, (G, 4)."""
    w, x, y, z = torch.nn.functional.normalize(rotation, dim=1, eps=math.ulp(0.0)).unbind(1)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return torch.stack([torch.stack(row, -1) for row in rows], -2)
