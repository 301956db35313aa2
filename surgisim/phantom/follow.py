"""A model moved through its scene: leapfrog, as `march`, with whatever an effect adds."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numba import njit
from scipy.spatial import Delaunay

from surgisim.phantom.forces import FAST, add_forces
from surgisim.phantom.march import SAFETY, least_swelling, stable_step
from surgisim.phantom.model import Model
from surgisim.phantom.scene import Hold
from surgisim.problem import Problem

Progress = Callable[[float, float, str], None]


def follow(model: Model, progress: Progress | None = None, text: str = "moving the tissue") -> np.ndarray:
    """Position of the scene's probes in every frame [m], (K, T, 3).

    Raises Problem when a position is not finite or an element turns inside out.
    """
    read = _reader(model)
    return np.stack([read(x) for x in nodes(model, progress, text)], 1)


def nodes(model: Model, progress: Progress | None = None, text: str = "moving the tissue") -> Iterator[np.ndarray]:
    """Position of the nodes in every frame [m], T of (N, 3), each valid until the next is asked for.

    Raises Problem when a position is not finite or an element turns inside out.
    """
    scene, x, v = model.scene, model.mesh.points.copy(), np.zeros_like(model.mesh.points)
    yield x
    steps = substeps(model)
    taken: dict[int, np.ndarray] = {}
    for frame in range(1, scene.frames):
        advance(model, x, v, frame, steps, taken)
        if not np.isfinite(x).all() or least_swelling(x, model.mesh.cells) <= 0:
            raise Problem(
                f"phantom: the elements turned inside out at frame {frame}, with {steps} steps a frame. Pull less "
                "far, conceal less, or take a finer spacing."
            )
        if progress:
            progress(frame, scene.frames - 1, text)
        yield x


def substeps(model: Model) -> int:
    """Stable steps a frame."""
    parts = replace(model.parts, mu=model.parts.mu + model.reserve[0], eta=model.parts.eta + model.reserve[1])
    stable = SAFETY * stable_step(model.mesh.points, parts, model.mesh.fixed)
    return math.ceil(1 / model.scene.fps / stable)


def advance(model: Model, x: np.ndarray, v: np.ndarray, frame: int, steps: int, taken: dict[int, np.ndarray]) -> None:
    """Move x and v from the frame before to `frame`.

    `taken` holds, for each grip that has closed, the displacement [m], (N, 3), in which it found the tissue; one that
    closes on the way is added.
    """
    scene, parts, rest = model.scene, model.parts, model.mesh.points
    dt = 1 / scene.fps / steps
    force, pull = np.empty_like(x), dt / parts.mass
    law = parts.cells, parts.inverse, parts.weight, parts.mu, parts.lam, parts.eta
    spans = [_held(hold, frame, steps) for hold in scene.holds]
    held: dict[int, tuple[np.ndarray, np.ndarray]] = {}
    for s in range(steps):
        for j, (first, end) in enumerate(spans):
            if s == first < end:
                mine = np.flatnonzero(model.mesh.gripped[j] & ~model.mesh.fixed)
                held[j] = mine, taken.setdefault(j, x - rest)[mine] + rest[mine]
            elif s == end:
                held.pop(j, None)
        t = (frame - 1) / scene.fps + s * dt
        force[:] = 0.0
        add_forces(x, v, *law, force)
        for extra in model.forces:
            extra.add(x, v, t, dt, force)
        if model.burden:
            pull = dt / (parts.mass + model.burden[1](t) * model.burden[0])
        _kick(v, force, pull)
        model.support.hold(x, v, t + dt, dt)
        for j, (mine, there) in held.items():
            v[mine] = (there + model.grasp[j](t + dt, rest[mine]) - x[mine]) / dt
        _drift(x, v, dt)


def _held(hold: Hold, frame: int, steps: int) -> tuple[int, int]:
    """The first step from the frame before to `frame` in which a grip holds, and one past the last."""
    closes, opens = hold.begin - hold.close_phase, hold.release + hold.release_phase
    first, end = (min(max(round((at - frame + 1) * steps), 0), steps) for at in (closes, opens))
    return first, end


def _reader(model: Model) -> Callable[[np.ndarray], np.ndarray]:
    """Position of the probes, linear between the upper side's nodes, from node positions."""
    block = model.mesh
    upper = np.flatnonzero(block.upper)
    sheet = Delaunay(block.uv[upper])
    triangle = sheet.find_simplex(model.scene.probes)
    base = sheet.transform[triangle]
    first = np.einsum("kij,kj->ki", base[:, :2], model.scene.probes - base[:, 2])
    weight = np.concatenate([first, 1 - first.sum(1, keepdims=True)], 1)
    corners = upper[sheet.simplices[triangle]]
    # The upper side is where the probes are, whatever mesh carries them there.
    start = model.scene.shape.upper(model.scene.probes)
    return lambda x: start + np.einsum("kc,kci->ki", weight, (x - block.points)[corners])


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _kick(v, force, pull):
    for n in range(len(v)):
        for i in range(3):
            v[n, i] += pull[n] * force[n, i]


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _drift(x, v, dt):
    for n in range(len(x)):
        for i in range(3):
            x[n, i] += dt * v[n, i]
