"""How fast scenes are drawn here, as JSON.

    python -m surgisim.gaussians.benchmark                  the CPU engine, on one thread and on all
    python -m surgisim.gaussians.benchmark --device cuda    gsplat through ours, beside gsplat itself
    python -m surgisim.gaussians.benchmark --clip FOLDER    a clip's scene, frame after frame; FOLDER holds scene.ply,
                                                            deformation.npz and camera.json

A closed surface seen from the front: Gaussians spread evenly over the view, 5 to 7 cm away, their radii 0.8 of their
spacing with a spread of a factor e^0.3, opacities 0.3 to 1. Each time is the shortest of several calls, through
torch and back, all else included.
"""

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
import torch

from surgisim.artifacts.base import load
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.deformation import Deformation
from surgisim.artifacts.scene import Scene
from surgisim.deformation.field import load_field
from surgisim.gaussians.engine_gsplat import lacking
from surgisim.gaussians.play import Play
from surgisim.gaussians.rasterise import rasterise
from surgisim.problem import Problem

CASES = ((10_000, 160, 128), (20_000, 160, 128), (20_000, 320, 250), (50_000, 640, 512))
CASES_ON_GPU = (*CASES[1:], (100_000, 640, 512))


def benchmark(calls: int = 12) -> dict:
    """Milliseconds of a forward and a backward pass for each case, on one thread and on all."""
    found = []
    for count, width, height in CASES:
        camera, scene = surface(count, width, height)
        row = {"gaussians": count, "width": width, "height": height}
        for threads in sorted({1, numba.config.NUMBA_NUM_THREADS}):
            numba.set_num_threads(threads)
            seen = rasterise(*scene, camera)
            row |= {f"forward_{threads}": shortest(lambda s=scene, c=camera: rasterise(*s, c), calls)}
            total = seen.rgb.sum() + seen.depth.sum() + seen.alpha.sum()
            row |= {f"backward_{threads}": shortest(lambda t=total: t.backward(retain_graph=True), calls)}
        row["alpha"] = round(float(seen.alpha.detach().mean()), 4)
        found.append(row)
    return {"unit": "ms", "name": "direction_threads", "numba": numba.__version__, "cases": found}


def on_gpu(calls: int = 50) -> dict:
    """Milliseconds of a forward pass, and of a forward and a backward one, ours and gsplat's by turns."""
    from gsplat import rasterization

    found = []
    for count, width, height in CASES_ON_GPU:
        camera, scene = surface(count, width, height)
        scene = [a.detach().cuda().requires_grad_() for a in scene]
        view, lens = torch.eye(4, device="cuda")[None], torch.tensor(camera.matrix, dtype=torch.float32).cuda()[None]

        def ours(scene=scene, camera=camera):
            image = rasterise(*scene, camera, engine="gsplat", weigh=False, checked=False)
            return image.rgb, image.depth

        def theirs(scene=scene, view=view, lens=lens, size=(width, height)):
            image, _, _ = rasterization(*scene, view, lens, *size, packed=False, render_mode="RGB+D")
            return image[..., :3], image[..., 3]

        def both_ways(draw, scene=scene):
            for a in scene:
                a.grad = None
            sum(a.sum() for a in draw()).backward()

        row: dict = {"gaussians": count, "width": width, "height": height}
        ways = {"forward": lambda draw: draw(), "forward_backward": both_ways}
        for name, way in ways.items():
            times: dict[str, list[float]] = {"ours": [], "gsplat": []}
            for _ in range(calls):
                for who, draw in (("ours", ours), ("gsplat", theirs)):
                    times[who].append(shortest(lambda d=draw, w=way: _waited(lambda: w(d)), 1))
            each = {who: float(np.median(t)) for who, t in times.items()}
            row |= {f"{name}_{who}": round(t, 3) for who, t in each.items()}
            row[f"{name}_ratio"] = round(each["ours"] / each["gsplat"], 3)
        found.append(row)
    return {"unit": "ms, median", "device": torch.cuda.get_device_name(), "cases": found}


def of_clip(folder: Path, rounds: int = 5) -> dict:
    """Frames a second of a clip's scene, each at its own moment, pictures staying on the device."""
    deformation, camera = load(Deformation, folder / "deformation.npz"), load(Camera, folder / "camera.json")
    scene = load(Scene, folder / "scene.ply")
    device = "cuda" if torch.cuda.is_available() else "cpu"
    play = Play(scene, load_field(deformation), deformation.moments, deformation.tint, camera, device)

    def through() -> None:
        for t in range(camera.frames):
            play.rgb(t / camera.fps, checked=False)

    wait = _waited if device == "cuda" else lambda work: work()
    wait(through)
    milliseconds = shortest(lambda: wait(through), rounds)
    return {
        "device": torch.cuda.get_device_name() if device == "cuda" else "cpu",
        "gaussians": len(scene.mean),
        "width": camera.width,
        "height": camera.height,
        "fps": round(1000 * camera.frames / milliseconds, 1),
    }


def _waited(work: Callable[[], object]) -> None:
    work()
    torch.cuda.synchronize()


def surface(count: int, width: int, height: int) -> tuple[Camera, list[torch.Tensor]]:
    """A camera and the attributes of what it sees, ready for gradients."""
    clip = {"fps": 25.0, "frames": 1, "scale": "known", "focal_from": "given", "source": "benchmark"}
    lens = {"fx": 1.2 * width, "fy": 1.2 * width, "cx": (width - 1) / 2, "cy": (height - 1) / 2}
    camera = Camera(width, height, **lens, **clip, source_size=[width, height], crop=[0, 0, width, height])
    rng = np.random.default_rng(0)
    z = rng.uniform(0.05, 0.07, count)
    mean = camera.lift(rng.uniform(0, 1, (count, 2)) * [width, height] - 0.5, z)
    radius = 0.8 * (width * height / count) ** 0.5 * z / camera.fx
    scale = radius[:, None] * np.exp(0.3 * rng.standard_normal((count, 3)))
    arrays = mean, rng.standard_normal((count, 4)), scale, rng.uniform(0.3, 1, count), rng.uniform(0, 1, (count, 3))
    return camera, [torch.tensor(a, dtype=torch.float32, requires_grad=True) for a in arrays]


def shortest(work: Callable[[], object], calls: int) -> float:
    """Shortest of several calls [ms]; the others waited for somebody else."""
    times = []
    for _ in range(calls):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return round(1000 * min(times), 2)


if __name__ == "__main__":
    asked = argparse.ArgumentParser(description="How fast scenes are drawn here.")
    asked.add_argument("--device", choices=("cpu", "cuda"), default="cpu")
    asked.add_argument("--clip", type=Path, help="folder with scene.ply, deformation.npz and camera.json")
    told = asked.parse_args()
    if told.device == "cuda" and (missing := lacking()):
        asked.error(f"--device cuda needs {missing}, which this machine lacks; leave it out.")
    try:
        found = of_clip(told.clip) if told.clip else on_gpu() if told.device == "cuda" else benchmark()
    except Problem as problem:
        asked.error(str(problem))
    print(json.dumps(found, indent=1))
