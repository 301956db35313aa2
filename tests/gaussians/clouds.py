"""Gaussians and cameras for the tests of this room."""

import torch

from surgisim.artifacts.camera import Camera

TOLERANCE = {"forward": 1e-6, "backward": 5e-6, "cuda": 1e-3, "differences": 1e-2}
"""Relative L2 norm of float32 against float64 (CUDA takes a fast exponential), and against its own differences."""
NAMES = ("mean", "rotation", "scale", "opacity", "color")


def camera(width: int, height: int, shift: float = 0.0) -> Camera:
    """A view of 45 degrees, its axis off the middle of the image."""
    lens = {"fx": 1.2 * width, "fy": 1.3 * width, "cx": width / 2 - 0.2 + shift, "cy": height / 2 - 1.2}
    clip = {"fps": 25.0, "frames": 1, "scale": "known", "focal_from": "given", "source": "clip"}
    return Camera(width, height, **lens, **clip, source_size=[width, height], crop=[0, 0, width, height])


def cloud(count: int, view: Camera, seed: int = 0, dtype=torch.float32) -> list[torch.Tensor]:
    """mean, rotation, scale, opacity, color of Gaussians spread a little beyond the view, 5 to 7 cm away."""
    draw = torch.Generator().manual_seed(seed)
    z = 0.05 + 0.02 * torch.rand(count, 1, generator=draw)
    pixel = torch.rand(count, 2, generator=draw) * 1.2 - 0.1
    pixel = pixel * torch.tensor([view.width, view.height]) - torch.tensor([view.cx, view.cy])
    mean = torch.cat([pixel / torch.tensor([view.fx, view.fy]) * z, z], 1)
    size = z / view.fx * (view.width * view.height / count) ** 0.5
    scale = size * torch.exp(0.5 * torch.randn(count, 3, generator=draw))
    rotation = torch.randn(count, 4, generator=draw)
    opacity = 0.02 + 0.98 * torch.rand(count, generator=draw)
    return [t.to(dtype) for t in (mean, rotation, scale, opacity, torch.rand(count, 3, generator=draw))]


def one(view: Camera, *, at=(20.0, 15.0), z=0.06, radius=3.0, opacity=0.8, color=(0.9, 0.5, 0.2)) -> list[torch.Tensor]:
    """One round Gaussian whose centre is seen at a pixel, its radius in pixels."""
    mean = [[(at[0] - view.cx) / view.fx * z, (at[1] - view.cy) / view.fy * z, z]]
    scale = [[radius * z / view.fx] * 3]
    return [torch.tensor(t) for t in (mean, [[1.0, 0, 0, 0]], scale, [opacity], [list(color)])]


def together(*clouds: list[torch.Tensor]) -> list[torch.Tensor]:
    return [torch.cat(parts) for parts in zip(*clouds, strict=True)]


def distance(value: torch.Tensor, truth: torch.Tensor) -> float:
    """Relative L2 norm of the difference, as one vector."""
    value, truth = value.detach().double(), truth.detach().double()
    return float((value - truth).norm() / truth.norm())
