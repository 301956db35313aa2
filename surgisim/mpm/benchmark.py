"""How long a step takes, forward and back, as JSON.

    python -m surgisim.mpm.benchmark --device cuda --particles 100000 --grid 50

A block of tissue of 50 x 50 x 12 cells (for --grid 50), fixed corotated and viscous, is pulled at its
face. Times are the best of a few bursts, so that other work on the machine disturbs them least.
"""

import argparse
import json
import resource
import time

import numpy as np
import warp as wp

from surgisim.artifacts.body import Body
from surgisim.artifacts.motion import Motion
from surgisim.mpm.setup import Prepared, prepare

VALUES = {"corotated": {"E": 3000.0, "nu": 0.45}, "newtonian": {"eta": 2.0}}
FPS, FRAMES, EXTENT = 25.0, 4, 0.06


def block(particles: int, grid: int, seed: int = 0) -> tuple[Body, Motion]:
    """Random particles in a slab `grid` cells wide and a quarter as thick [m], and a pull of 3 mm at its face."""
    spacing = EXTENT / grid
    size = np.array([EXTENT, EXTENT, max(4, grid // 4) * spacing])
    rest = np.random.default_rng(seed).uniform(0, 1, (particles, 3)) * size + [0, 0, 0.05]
    # Sorted by cell: neighbours in memory share their nodes.
    cell = ((rest - rest.min(0)) / spacing).astype(int)
    rest = rest[np.lexsort(cell.T[::-1])]
    volume = np.full(particles, size.prod() / particles)
    held = rest[:, 2] > rest[:, 2].max() - spacing
    body = Body(
        rest.astype(np.float32), volume.astype(np.float32), np.full((particles, 3), 0.5, np.float32),
        rest[:, 2] < 0.05 + spacing, held, spacing,
    )  # fmt: skip
    center = np.array([[EXTENT / 2, EXTENT / 2, 0.05]])
    path = center + np.linspace(0, 1, FRAMES)[:, None] * np.array([0.0, 0.0, -0.003])
    radius = np.array([max(0.005, 2 * spacing)])
    return body, Motion(center, radius, path[None], np.ones((1, FRAMES), bool), np.ones(1), "given")


def measure(device: str, particles: int, grid: int, bursts: int) -> dict:
    """Microseconds per step, forward and adjoint (its recomputation not counted), and memory [MB]."""
    body, motion = block(particles, grid)
    made = prepare(body, tuple(VALUES), density=1050.0, device=device)
    path = made.drive(motion, VALUES, fps=FPS, per_frame=made.per_frame(VALUES, FPS))
    theta, steps = made.theta(VALUES), path.steps
    run = made.simulator.run(theta, path)
    made.simulator.gradient(theta, path, run, np.ones_like(run.u))
    forward = min(_seconds(lambda: made.simulator.run(theta, path), device) for _ in range(bursts))
    both = min(
        _seconds(lambda: made.simulator.gradient(theta, path, run, np.ones_like(run.u)), device) for _ in range(bursts)
    )
    return {
        "device": _name(device),
        "particles": particles,
        "grid": grid,
        "nodes": len(made.simulator.place),
        "steps_timed": steps,
        "forward_us": round(1e6 * forward / steps, 1),
        "adjoint_us": round(1e6 * (both - forward) / steps, 1),
        "adjoint_over_forward": round((both - forward) / forward, 2),
        "particle_steps_per_second": round(particles * steps / forward),
        "peak_mb": round(_peak(device, made)),
        "warp": wp.__version__,
    }


def _seconds(work, device: str) -> float:
    wp.synchronize_device(device)
    begun = time.perf_counter()
    work()
    wp.synchronize_device(device)
    return time.perf_counter() - begun


def _name(device: str) -> str:
    return wp.get_device(device).name


def _peak(device: str, made: Prepared) -> float:
    if wp.get_device(device).is_cuda:
        return wp.get_mempool_used_mem_high(device) / 2**20
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    cli = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    cli.add_argument("--device", choices=["cpu", "cuda"], default="cpu")
    cli.add_argument("--particles", type=int, nargs="+", default=[5000, 20000])
    cli.add_argument("--grid", type=int, default=50, help="cells along the longest side")
    cli.add_argument("--bursts", type=int, default=3)
    arguments = cli.parse_args()
    rows = [measure(arguments.device, n, arguments.grid, arguments.bursts) for n in arguments.particles]
    print(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
