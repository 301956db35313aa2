"""The engine and the phantom's finite elements on our own kind of manipulation, nothing hidden.

Eight blocks of tissue (about 60 x 43 mm, 14-18 mm thick, gently hilly, turned and slanted against the grid, held at the
base), E 2-8 kPa, nu .40-.47, eta / E 1-3 ms: a ball of 4.5-6.5 mm radius at the surface is carried 7-10 mm obliquely,
held and let go; a second grip elsewhere pulls 3-5 mm. Both solvers have the same law (neo-Hookean with Ciarlet's
volumetric energy, written down twice, and Newtonian viscosity), the same parameters, the same path; they share no code.
The phantom's elements: total-Lagrangian hexahedra with one mean dilatation each, leapfrog (surgisim/phantom), on a
mesh whose faces fit both balls.

Error model: outside the ball both converge with a power of the spacing; at the ball's skin, where a rigid inclusion
meets a free surface, the strain is singular and every method is slow. The elements' own refinement is measured beside.
"""

from functools import partial

import numpy as np

from surgisim.config.thickening import Thickening
from surgisim.verification.drawing import COLORS, legend, panels, reference, slope
from surgisim.verification.manipulated import elements, particles
from surgisim.verification.manipulated.compare import RINGS, compare, curve, rms
from surgisim.verification.manipulated.covariance import model_error
from surgisim.verification.manipulated.page import BOUNDS, words
from surgisim.verification.manipulated.scene import FINE, FPS, LEAVE_2, Scene, invent

__all__ = ["TITLE", "draw", "measure", "words"]

TITLE = "Pulling tissue: finite elements"

SEEDS = tuple(range(8))
CELLS = (Thickening().cells, 15, 20)
"""Grid cells along the block's longest side; the first is what thickening makes by default."""
ELEMENTS = (2.0e-3, 1.75e-3)
"""Edges of the elements [m]; the last is what the engine is compared with."""
LADDER = (3.0e-3, 2.5e-3, 2.0e-3, 1.75e-3, 1.5e-3)
"""Edges [m] with which the elements' own convergence is shown, on the first seed's pull."""


def measure(progress, quick: bool = False) -> dict:
    seeds, cells, edges = (SEEDS[5:6], CELLS[:1], (2.5e-3, 2.2e-3)) if quick else (SEEDS, CELLS, ELEMENTS)
    scenes = [invent(seed) for seed in seeds]
    frames = scenes[0].holds[0].release + LEAVE_2 if quick else None
    rows, left, shown, total = [], [], {}, len(seeds) * (len(edges) + len(cells))
    for n, scene in enumerate(scenes):
        tell = partial(_part, progress, n * (len(edges) + len(cells)), total)
        probes = scene.probes()
        truths = [elements.follow(scene, h, probes, tell(k), frames) for k, h in enumerate(edges)]
        runs = {}
        for k, count in enumerate(cells):
            spacing = float((scene.shape.high - scene.shape.low).max()) / count
            runs[count] = particles.follow(scene, spacing, probes, tell(len(edges) + k), frames)
            told = {"seed": scene.seed, "cells": count, "spacing": spacing, **compare(scene, runs[count], truths[-1])}
            rows.append({**told, "elements": compare(scene, truths[0], truths[-1])})
        left.append(runs[cells[0]] - truths[-1])
        if not shown:
            shown = _shown(scene, runs, truths[-1])
            if not quick:
                shown["ladder"] = _ladder(scene)
    return {
        "scenes": [_scene(scene) for scene in scenes],
        "edges": list(edges),
        "rows": rows,
        "slope": _slope(rows) if len(cells) > 1 else None,
        "shown": shown,
        "model_error": model_error(scenes, left),
    }


def _part(progress, begin, total, k):
    return lambda done, of, text: progress(begin + k + done / of, total, text)


def _scene(scene: Scene) -> dict:
    law, holds = scene.law, scene.holds
    return {
        "seed": scene.seed,
        "thickness": scene.shape.thickness,
        "E": law.E,
        "nu": law.nu,
        "eta": law.eta,
        "radii": [h.grip.radius for h in holds],
        "pulls": [float(np.linalg.norm(h.pull)) for h in holds],
        "lifts": [float(np.arcsin(-(h.pull @ scene.shape.axes[2]) / np.linalg.norm(h.pull))) for h in holds],
    }


def _shown(scene: Scene, runs: dict[int, np.ndarray], truth: np.ndarray) -> dict:
    """Curves of one scene for the picture."""
    count, run = next(iter(runs.items()))
    return {
        "seed": scene.seed,
        "cells": count,
        "motion": _over_time(truth),
        "difference": _over_time(run - truth),
        "rebound": {"elements": curve(scene, scene.holds[0], truth), "engine": curve(scene, scene.holds[0], run)},
    }


def _over_time(field: np.ndarray) -> np.ndarray:
    """RMS over the points at every frame."""
    return np.sqrt((field[::FINE] ** 2).sum(-1).mean(1))


def _ladder(scene: Scene) -> dict:
    """Difference of each mesh from the finest just after the pull has arrived [m]."""
    runs = [elements.follow(scene, h, scene.probes(), frames=scene.holds[0].arrive + 2)[-1] for h in LADDER]
    return {"edges": LADDER[:-1], "finest": LADDER[-1], "difference": [rms(r - runs[-1]) for r in runs[:-1]]}


def _slope(rows: list[dict]) -> dict:
    """Power of the spacing with which the difference falls: of every seed, and mean of all in the grip's rings."""
    seeds = sorted({r["seed"] for r in rows})
    mine = {s: sorted((r for r in rows if r["seed"] == s), key=lambda r: r["cells"]) for s in seeds}
    rings = {
        ring: float(np.mean([_power(m, lambda r, g=ring: r["rings"][g]) for m in mine.values()])) for ring in RINGS
    }
    return {"seeds": {s: _power(m, lambda r: r) for s, m in mine.items()}, "rings": rings}


def _power(rows: list[dict], part) -> float:
    return slope([r["spacing"] for r in rows], [part(r)["difference"] for r in rows])


def draw(result: dict):
    figure, axes = panels(3)
    seeds = [s["seed"] for s in result["scenes"]]
    for color, seed in zip(COLORS * 2, seeds, strict=False):
        mine = [r for r in result["rows"] if r["seed"] == seed]
        x, y = [1000 * r["spacing"] for r in mine], [100 * r["share"] for r in mine]
        axes[0].loglog(x, y, "o-", color=color, markersize=4, linewidth=1, label=f"seed {seed}")
    own = 100 * float(np.mean([r["elements"]["share"] for r in result["rows"]]))
    axes[0].axhline(100 * BOUNDS["share"], color="#1c2127", linewidth=0.8)
    axes[0].axhline(own, color="#5d6773", linewidth=1, linestyle=":", label="elements, coarse - fine")
    x = [1000 * r["spacing"] for r in result["rows"]]
    if len(set(x)) > len(seeds):
        reference(axes[0], x, 6.0, 1)
    axes[0].set(
        xlabel="grid spacing [mm]", ylabel="difference / motion, RMS [%]", title="All surface points and frames"
    )
    legend(axes[0], ncols=2)
    shown = result["shown"]
    time = np.arange(len(shown["motion"])) / FPS
    axes[1].semilogy(time[1:], 1000 * np.array(shown["motion"][1:]), color=COLORS[0], label="motion")
    axes[1].semilogy(time[1:], 1000 * np.array(shown["difference"][1:]), color=COLORS[1], label="difference")
    axes[1].set(xlabel="time [s]", ylabel="RMS over the surface [mm]", title=f"Seed {shown['seed']}, default grid")
    axes[1].set_ylim(1e-4, None)
    legend(axes[1])
    for color, (name, along) in zip(COLORS, shown["rebound"].items(), strict=False):
        axes[2].plot(1000 * np.arange(len(along)) / FPS / FINE, 1000 * np.array(along), color=color, label=name)
    axes[2].set(xlabel="time after the release [ms]", ylabel="along the pull [mm]", title="Tissue around the grip")
    legend(axes[2])
    return figure
