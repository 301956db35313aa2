"""How fast the CPU engine is here: `python -m surgisim.gaussians.benchmark` prints JSON.

A closed surface seen from the front: Gaussians spread evenly over the view, 5 to 7 cm away, their radii 0.8 of their
spacing with a spread of a factor e^0.3, opacities 0.3 to 1. Each time is the shortest of several calls, through
torch and back, all else included.
"""

import json
import time
from collections.abc import Callable

import numba
import numpy as np
import torch

from surgisim.artifacts.camera import Camera
from surgisim.gaussians.rasterise import rasterise

CASES = ((10_000, 160, 128), (20_000, 160, 128), (20_000, 320, 250), (50_000, 640, 512))


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
    print(json.dumps(benchmark(), indent=1))
