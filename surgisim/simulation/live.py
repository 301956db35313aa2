"""Splats that follow a running simulation on the GPU, and how many frames a second that gives, as JSON.

    python -m surgisim.simulation.live --particles 100000 --gaussians 50000 --steps 10000

Nothing but a picture leaves the device: the grid's displacement carries every splat's mean and turns and stretches its
covariance, Sigma <- F Sigma F^T (Xie et al., PhysGaussian, CVPR 2024, eq. 8), and gsplat draws it.
"""

import argparse
import json
import time

import numpy as np
import torch
import warp as wp

from surgisim.artifacts.camera import Camera
from surgisim.gaussians.engine_gsplat import draw_covariances, lacking
from surgisim.mpm.benchmark import VALUES, block
from surgisim.mpm.endurance import operation
from surgisim.mpm.setup import prepare
from surgisim.mpm.simulator import Simulator
from surgisim.problem import Problem

WIDTH, HEIGHT, FPS = 640, 512, 25.0


class Live:
    """Gaussians bound to a simulator's nodes, on its device."""

    def __init__(self, mean, covariance, opacity, color, simulator: Simulator) -> None:
        """mean (G, 3) and covariance (G, 3, 3) at rest [m, m^2], opacity (G,), color (G, 3) between 0 and 1."""
        missing = lacking()
        if missing:
            raise Problem(f"live: drawing on the GPU needs {missing}, which this machine lacks. Simulate on the CPU.")
        put = lambda a: torch.as_tensor(np.ascontiguousarray(a, np.float32), device="cuda")  # noqa: E731
        self.mean, self.covariance, self.opacity, self.color = map(put, (mean, covariance, opacity, color))
        index, link = simulator.links(np.asarray(mean, float))
        self.index, self.weight, self.slope = (
            torch.as_tensor(index, device="cuda"),
            put(link[..., 0]),
            put(link[..., 1:]),
        )
        self.eye = torch.eye(3, device="cuda")

    def picture(self, displacement: wp.array, camera: Camera) -> torch.Tensor:
        """(H, W, 3) uint8 on the device, at nodal displacements [m], (A,) vec3."""
        u = wp.to_torch(displacement)[self.index]
        mean = self.mean + torch.einsum("gk,gka->ga", self.weight, u)
        F = self.eye + torch.einsum("gka,gkb->gab", u, self.slope)
        seen, _ = draw_covariances(mean, F @ self.covariance @ F.transpose(1, 2), self.opacity, self.color, camera)
        return (255 * seen.clamp(0, 1)).round().to(torch.uint8)


def measure(particles: int, gaussians: int, grid: int, steps: int, frames: int) -> dict:
    """Frames a second of simulating `steps` steps a second of video and drawing 640 x 512 pixels."""
    body, motion = block(particles, grid)
    made = prepare(body, tuple(VALUES), density=1050.0, device="cuda")
    path = made.drive(operation(motion, float(np.ptp(body.rest[:, 2]))), VALUES, fps=FPS, per_frame=round(steps / FPS))
    rng = np.random.default_rng(0)
    low, high = body.rest.min(0).astype(float), body.rest.max(0).astype(float)
    mean = np.c_[rng.uniform(low[:2], high[:2], (gaussians, 2)), rng.uniform(low[2], low[2] + body.spacing, gaussians)]
    radius = 0.8 * np.sqrt(np.prod((high - low)[:2]) / gaussians) * np.exp(0.3 * rng.standard_normal((gaussians, 3)))
    covariance = np.eye(3) * radius[:, None] ** 2
    live = Live(mean, covariance, rng.uniform(0.3, 1, gaussians), rng.uniform(0, 1, (gaussians, 3)), made.simulator)
    focal, middle = 1.2 * WIDTH, (low + high)[:2] / 2
    live.mean[:, :2] -= torch.as_tensor(middle.astype(np.float32), device="cuda")
    clip = {"fps": FPS, "frames": frames, "scale": "known", "focal_from": "given", "source": "benchmark"}
    lens = {"fx": focal, "fy": focal, "cx": (WIDTH - 1) / 2, "cy": (HEIGHT - 1) / 2}
    camera = Camera(WIDTH, HEIGHT, **lens, **clip, source_size=[WIDTH, HEIGHT], crop=[0, 0, WIDTH, HEIGHT])
    times, pictures = [], 0
    for k, (_, u) in enumerate(made.simulator.play(made.theta(VALUES), path, last=frames)):
        picture = live.picture(u, camera).cpu().numpy()
        pictures += int(picture.any())
        times.append(time.perf_counter())
        if k == 0:
            first = picture
    # The first frames load kernels and record graphs.
    spent = np.diff(times)[2:]
    return {
        "device": wp.get_device("cuda").name,
        "particles": len(body.rest),
        "gaussians": gaussians,
        "steps_per_second_of_video": steps,
        "frames": len(spent),
        "frames_per_second": round(1 / float(spent.mean()), 1),
        "slowest_frame_ms": round(1e3 * float(spent.max()), 1),
        "pictures_with_content": pictures,
        "pixels_changed": int((picture != first).any(-1).sum()),
    }


def main() -> None:
    cli = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    cli.add_argument("--particles", type=int, default=100_000)
    cli.add_argument("--gaussians", type=int, default=50_000)
    cli.add_argument("--grid", type=int, default=50, help="cells along the longest side")
    cli.add_argument("--steps", type=int, default=10_000, help="a second of video")
    cli.add_argument("--frames", type=int, default=75)
    print(json.dumps(measure(**vars(cli.parse_args())), indent=1))


if __name__ == "__main__":
    main()
