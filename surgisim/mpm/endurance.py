"""A long operation, and what it keeps: energy and momentum over time, as JSON.

    python -m surgisim.mpm.endurance --device cuda --particles 100000 --steps 80000

A block of tissue is pulled at its face, held and let go within 8 s, as the paper's operations are, in as many steps as
asked. A number that stops being finite ends the run, as in every run. Work comes in through the grip only, and the
law dissipates: once the tissue is let go, its energy may only fall.
"""

import argparse
import json
import math
import sys
import time
from collections.abc import Callable

import matplotlib.pyplot as plt
import numpy as np
import warp as wp
from matplotlib.figure import Figure
from scipy import sparse

from surgisim.artifacts.motion import Motion
from surgisim.mpm.benchmark import VALUES, block
from surgisim.mpm.setup import Prepared, prepare
from surgisim.physics.catalogue import choose
from surgisim.problem import Problem

SECONDS, FPS, SHARE = 8.0, 25.0, 0.4
"""How long [s], frames a second, and how far the pull goes, as a share of the block's thickness."""
PULL, RELEASE = (0.5, 2.0), 5.0
"""When the grip moves, and when it lets go [s]."""
EVERY = 5
"""Frames between two entries of the log."""


def operation(motion: Motion, thickness: float) -> Motion:
    """A pull, a hold and a release of the block's grip."""
    t = np.arange(round(SECONDS * FPS) + 1) / FPS
    far = np.clip((t - PULL[0]) / (PULL[1] - PULL[0]), 0, 1)
    way = np.array([0.6, 0.0, -0.8]) * SHARE * thickness
    path = motion.center_rest + (0.5 - 0.5 * np.cos(math.pi * far))[:, None] * way
    return Motion(motion.center_rest, motion.radius, path[None], (t < RELEASE)[None], motion.confidence, "given")


def endure(device: str, particles: int, grid: int, steps: int) -> dict:
    """Energies [J] and momentum [kg m/s] over time, and how long a step took. Raises Problem."""
    body, motion = block(particles, grid)
    made = prepare(body, tuple(VALUES), density=1050.0, device=device)
    per_frame = math.ceil(steps / (SECONDS * FPS))
    least = made.per_frame(VALUES, FPS)
    if per_frame < least:
        raise Problem(
            f"--steps: {steps} steps in {SECONDS:g} s are not stable; ask for at least {round(least * SECONDS * FPS)}."
        )
    path = made.drive(operation(motion, float(np.ptp(body.rest[:, 2]))), VALUES, fps=FPS, per_frame=per_frame)
    theta, mass, stored_in = made.theta(VALUES), made.simulator.mass.numpy().astype(float), _stored(made)
    at, kinetic, stored, momentum, farthest, spent = [], [], [], [], [], 0.0
    begun = time.perf_counter()
    for frame, ((u, v, _), _) in enumerate(made.simulator.play(theta, path)):
        spent += time.perf_counter() - begun
        if frame % EVERY == 0:
            at.append(frame / FPS)
            kinetic.append(float(0.5 * mass @ (v.astype(float) ** 2).sum(-1)))
            stored.append(stored_in(u.astype(float)))
            momentum.append((mass @ v.astype(float)).tolist())
            farthest.append(float(np.linalg.norm(u, axis=-1).max()))
        begun = time.perf_counter()
    total = np.add(kinetic, stored)[np.array(at) >= RELEASE]
    return {
        "device": wp.get_device(device).name,
        "particles": len(body.rest),
        "steps": path.steps,
        "seconds": round(spent, 2),
        "us_per_step": round(1e6 * spent / path.steps, 1),
        "largest_displacement_mm": round(1e3 * max(farthest), 3),
        "energy_at_release_J": float(total[0]),
        "energy_at_end_J": float(total[-1]),
        "largest_rise_after_release": float(np.diff(total).max() / total[0]),
        "time_s": at,
        "kinetic_J": kinetic,
        "stored_J": stored,
        "momentum_kg_m_s": momentum,
    }


def _stored(made: Prepared) -> Callable[[np.ndarray], float]:
    """Elastic energy [J] by nodal displacement [m], (A, 3)."""
    body, laws = made.body, {name: term for name, term in choose(made.terms).items() if term.energy}
    index, link = made.simulator.links(body.rest.astype(float))
    rows = np.repeat(np.arange(len(index)), index.shape[1])
    size = (len(index), len(made.simulator.place))
    slopes = [sparse.csr_matrix((link[..., k].ravel(), (rows, index.ravel())), size) for k in (1, 2, 3)]

    def energy(u: np.ndarray) -> float:
        F = np.eye(3) + np.stack([slope @ u for slope in slopes], -1)
        return float(body.volume.astype(float) @ sum(t.energy(F, **VALUES[n]) for n, t in laws.items()))

    return energy


def draw(result: dict) -> Figure:
    """Energies and momentum over time."""
    figure, (energy, momentum) = plt.subplots(2, 1, figsize=(7, 5), sharex=True, layout="constrained")
    time = result["time_s"]
    for name in ("stored", "kinetic"):
        energy.semilogy(time, np.maximum(result[f"{name}_J"], 1e-30), label=name)
    energy.set_ylim(1e-22, None)
    energy.set_ylabel("energy [J]")
    energy.legend()
    momentum.plot(time, result["momentum_kg_m_s"], label=["x", "y", "z"])
    momentum.set_ylabel("momentum [kg m/s]")
    momentum.set_xlabel("time [s]")
    momentum.legend()
    for axis in (energy, momentum):
        axis.axvspan(*PULL, color="0.9")
        axis.axvline(RELEASE, color="0.5", linestyle=":")
    energy.set_title(f"{result['particles']} particles, {result['steps']} steps: pulled (grey), held, let go (dotted)")
    return figure


def main() -> int:
    cli = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    cli.add_argument("--device", choices=["cpu", "cuda"], default="cpu")
    cli.add_argument("--particles", type=int, default=100_000)
    cli.add_argument("--grid", type=int, default=50, help="cells along the longest side")
    cli.add_argument("--steps", type=int, default=80_000, help="in 8 s")
    cli.add_argument("--picture", help="where to draw the log, a PNG")
    arguments = cli.parse_args()
    try:
        result = endure(arguments.device, arguments.particles, arguments.grid, arguments.steps)
    except Problem as problem:
        print(problem, file=sys.stderr)
        return 2
    if arguments.picture:
        draw(result).savefig(arguments.picture, dpi=110)
    print(json.dumps(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
