"""A scene moved by the phantom's finite elements."""

import math
from collections.abc import Callable

import numpy as np
from scipy.spatial import Delaunay

from surgisim.phantom.elements import Elements, elements
from surgisim.phantom.march import SAFETY, advance, least_swelling, stable_step
from surgisim.phantom.ogrid import Mesh, mesh
from surgisim.problem import Problem
from surgisim.verification.manipulated.scene import FINE, FPS, Scene


def follow(
    scene: Scene,
    spacing: float,
    probes: np.ndarray,
    progress: Callable[[float, float, str], None] = lambda done, total, text: None,
    frames: int | None = None,
    parts: Callable[[Mesh], Elements] | None = None,
) -> np.ndarray:
    """Displacement [m] of surface points `probes` (u, v) [m], (K, 2), at `scene.clock()`, (T, K, 3).

    spacing: edge of the elements [m]; frames: stop after so many; parts: the elements of a mesh, of the scene's law
    where not given. Raises Problem when an element turns inside out.
    """
    first, second = scene.holds
    block = mesh(scene.shape, (first.grip, second.grip), spacing)
    parts = elements(block.points, block.cells, scene.law) if parts is None else parts(block)
    clock = scene.clock() if frames is None else np.arange((frames - 1) * FINE + 1) / FINE
    substeps = math.ceil(1 / FPS / FINE / (SAFETY * stable_step(block.points, parts, block.fixed)))
    dt = 1 / FPS / FINE / substeps
    x, v = block.points.copy(), np.zeros_like(block.points)
    scratch, pull = np.zeros_like(x), dt / parts.mass
    pull[block.fixed] = 0.0
    arrays = parts.cells, parts.inverse, parts.weight, parts.mu, parts.lam, parts.eta
    read = _reader(block, probes)
    moved = np.zeros((len(clock), len(probes), 3))
    driven = [np.flatnonzero(inside & ~block.fixed) for inside in block.gripped]
    for t in range(1, len(clock)):
        ends = clock[t - 1] + np.arange(substeps + 1) / substeps / FINE
        # A frame's end decides: both grips close and open on frames.
        j = 0 if clock[t] <= first.release + 1e-9 else 1
        hold = scene.holds[j]
        held = np.full(substeps, hold.begin + 1e-9 < clock[t] <= hold.release + 1e-9)
        advance(x, v, block.points, pull, driven[j], hold.path(ends), held, dt, *arrays, scratch)
        if not np.isfinite(x).all() or least_swelling(x, block.cells) <= 0:
            raise Problem(
                f"manipulation, seed {scene.seed}: the finite elements of {spacing} m turned inside out at frame "
                f"{clock[t]:.1f}. Pull less far, or take a finer mesh."
            )
        moved[t] = read(x)
        progress(t, len(clock) - 1, f"finite elements, {1000 * spacing:.2g} mm")
    return moved


def _reader(block: Mesh, probes: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Displacement of the upper side, linear between its nodes, from node positions."""
    upper = np.flatnonzero(block.upper)
    sheet = Delaunay(block.uv[upper])
    triangle = sheet.find_simplex(probes)
    base = sheet.transform[triangle]
    first = np.einsum("kij,kj->ki", base[:, :2], probes - base[:, 2])
    weight = np.concatenate([first, 1 - first.sum(1, keepdims=True)], 1)
    nodes = upper[sheet.simplices[triangle]]
    return lambda x: np.einsum("kc,kci->ki", weight, (x - block.points)[nodes])
