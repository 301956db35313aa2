"""The paper's image loss: rendered simulation against the recording, and back to the grid.

L_v = | C_recorded - C_simulated |_1 M / sum M
"""

from collections.abc import Callable
from typing import Literal

import numpy as np

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.scene import Scene
from surgisim.mpm.simulator import Simulator


def picture_loss(
    scene: Scene,
    camera: Camera,
    rgb: np.ndarray,
    mask: np.ndarray,
    simulator: Simulator,
    frames: np.ndarray,
    *,
    engine: Literal["numba", "gsplat", "twin"] = "numba",
) -> Callable[[np.ndarray], tuple[float, np.ndarray]]:
    """From u (T, A, 3) to the mean misfit over `frames` and its derivative (T, A, 3).

    rgb: recording, (T, H, W, 3) uint8; mask: tissue to compare, (T, H, W) bool. Splats move with the
    body; their shape is kept, which costs little at the strains between two frames of one clip.
    engine: of the rasteriser; 'twin' works in double precision, for tests.
    """
    import torch

    from surgisim.gaussians.rasterise import rasterise

    real = torch.float64 if engine == "twin" else torch.float32
    carry = simulator.carry(scene.mean)
    fixed = [
        torch.tensor(np.ascontiguousarray(a), dtype=real)
        for a in (scene.rotation, np.exp(scene.scale), 1 / (1 + np.exp(-scene.opacity)), scene.color)
    ]

    def misfit(u: np.ndarray) -> tuple[float, np.ndarray]:
        total, u_bar = 0.0, np.zeros(u.shape)
        for t in frames:
            mean = torch.tensor(scene.mean + carry @ u[t].astype(float), dtype=real, requires_grad=True)
            shown = rasterise(mean, *fixed, camera, engine=engine).rgb
            wanted = torch.tensor(rgb[t], dtype=real) / 255
            seen = torch.tensor(mask[t], dtype=real)[..., None]
            loss = ((shown - wanted).abs() * seen).sum() / (3 * seen.sum().clamp(min=1)) / len(frames)
            loss.backward()
            total += float(loss.detach())
            u_bar[t] = carry.T @ mean.grad.numpy().astype(float)
        return total, u_bar

    return misfit
