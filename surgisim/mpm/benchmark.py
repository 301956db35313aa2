"""How long a step takes, forward and back, as JSON.

    python -m surgisim.mpm.benchmark --device cuda --particles 100000 --grid 50 --json

A block of tissue, fixed corotated and viscous, is pulled at its face. On a CPU, `plain` is a plain Warp step of the
updated form (scatter, nodes, gather) on one thread, in the same run. Times are the best of a few bursts, so that other
work on the machine disturbs them least.
"""

import argparse
import json
import math
import resource
import time

import numpy as np
import warp as wp

from surgisim.artifacts.body import Body
from surgisim.artifacts.motion import Motion
from surgisim.mpm.grip import Drive
from surgisim.mpm.setup import Prepared, prepare
from surgisim.mpm.updated import Updated

VALUES = {"corotated": {"E": 3000.0, "nu": 0.45}, "newtonian": {"eta": 2.0}}
STEPS, EXTENT = 256, 0.06
"""Steps between two frames, and width of the world [m]."""
FRAMES = {"cpu": 2, "cuda": 65}
"""Of the motion: on a GPU enough that setting up a run, some milliseconds, does not count."""
MEMORY = 2048.0
"""What the adjoint may record [MB]: all steps at once, so that it computes the run again just once."""


def block(particles: int, grid: int, frames: int = 2, seed: int = 0) -> tuple[Body, Motion]:
    """A jittered lattice of 8 particles a cell, four times as wide as thick, in a world `grid` cells wide [m].

    A pull at its face drives it.
    """
    spacing = EXTENT / grid
    thick = max(2, round((particles / 8 / 16) ** (1 / 3)))
    wide = max(2, round(math.sqrt(particles / 8 / thick)))
    cells = np.array([wide, wide, thick])
    lattice = np.stack(np.meshgrid(*[np.arange(2 * n) for n in cells], indexing="ij"), -1).reshape(-1, 3)
    jitter = np.random.default_rng(seed).uniform(-0.3, 0.3, lattice.shape)
    rest = (lattice + 0.5 + jitter) * spacing / 2 + [0, 0, 0.05]
    # Sorted by cell: neighbours in memory share their nodes.
    cell = lattice // 2
    rest = rest[np.lexsort(cell.T[::-1])]
    volume = np.full(len(rest), (spacing / 2) ** 3)
    held = rest[:, 2] > rest[:, 2].max() - spacing
    body = Body(
        rest.astype(np.float32), volume.astype(np.float32), np.full((len(rest), 3), 0.5, np.float32),
        rest[:, 2] < 0.05 + spacing, held, spacing,
    )  # fmt: skip
    center = np.array([[*(wide * spacing / 2, wide * spacing / 2), 0.05]])
    path = center + np.linspace(0, 1, frames)[:, None] * np.array([0.0, 0.0, -0.1 * spacing])
    return body, Motion(center, np.array([2 * spacing]), path[None], np.ones((1, frames), bool), np.ones(1), "given")


def measure(device: str, particles: int, grid: int, bursts: int, threads: int, bend: bool) -> dict:
    """Microseconds per step, forward and adjoint (its recomputation not counted), and memory [MB].

    bend: whether the displacement may bend at the skin of the grip (kink.py).
    """
    body, motion = block(particles, grid, FRAMES[device])
    grips = motion if bend else None
    made = prepare(body, tuple(VALUES), density=1050.0, device=device, threads=threads, grips=grips)
    step = 1 / made.per_frame(VALUES, fps=1.0)
    path = made.drive(motion, VALUES, fps=1 / (STEPS * step), per_frame=STEPS)
    theta, steps = made.theta(VALUES), path.steps
    run = made.simulator.run(theta, path)

    def back() -> None:
        made.simulator.gradient(theta, path, run, np.ones_like(run.u), memory_mb=MEMORY)

    back()
    forward = min(_seconds(lambda: made.simulator.run(theta, path), device) for _ in range(bursts))
    both = min(_seconds(back, device) for _ in range(bursts))
    plain = {} if wp.get_device(device).is_cuda or bend else _plain(made, theta, path, bursts, forward)
    return {
        "device": _name(device),
        "threads": threads,
        "particles": len(body.rest),
        "grid": grid,
        "nodes": len(made.simulator.place),
        "kinks": made.simulator.kinks.count,
        "steps_timed": steps,
        "forward_us": round(1e6 * forward / steps, 1),
        **plain,
        "adjoint_us": round(1e6 * (both - forward) / steps, 1),
        "adjoint_over_forward": round((both - forward) / forward, 2),
        "particle_steps_per_second": round(particles * steps / forward),
        "peak_mb": round(_peak(device, made)),
        "warp": wp.__version__,
    }


def _plain(made: Prepared, theta: np.ndarray, path: Drive, bursts: int, forward: float) -> dict:
    s = made.simulator
    plain = Updated(rest=s.rest, volume=s.volume_p, density=made.density, grid=s.grid, terms=made.terms)
    seconds = min(_seconds(lambda: plain.run(theta, path), "cpu") for _ in range(bursts))
    return {"plain_us": round(1e6 * seconds / path.steps, 1), "faster_than_plain": round(seconds / forward, 2)}


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
    cli.add_argument("--threads", type=int, nargs="+", default=[1, 2], help="on a CPU")
    cli.add_argument("--bursts", type=int, default=3)
    cli.add_argument("--bend", action="store_true", help="at the skin of the grip, as in a diagnosis")
    cli.add_argument("--json", action="store_true", help="print JSON and not a line a row")
    arguments = cli.parse_args()
    threads = arguments.threads if arguments.device == "cpu" else [1]
    rows = [
        measure(arguments.device, n, arguments.grid, arguments.bursts, t, arguments.bend)
        for n in arguments.particles
        for t in threads
    ]
    if arguments.json:
        print(json.dumps(rows, indent=1))
        return
    for row in rows:
        shown = {key: f"{value:.4g}" if isinstance(value, float) else value for key, value in row.items()}
        print("  ".join(f"{key} {value}" for key, value in shown.items()))


if __name__ == "__main__":
    main()
