"""Explicit steps in time: leapfrog, velocities half a step behind positions."""

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numba import njit

from surgisim.phantom.block import Block
from surgisim.phantom.elements import SLOPES, Elements
from surgisim.phantom.forces import FAST, add_forces
from surgisim.problem import Problem

SAFETY = 0.6
"""Of the largest stable step at rest; stretched and squeezed elements need smaller ones."""
FINER = 2
"""Times more steps a frame with which all is moved once more where they were too few after all."""


@dataclass(frozen=True)
class Drive:
    """How the gripped nodes are carried."""

    shift: Callable[[np.ndarray], np.ndarray]
    """Displacement [m], (S, 3), at times [s], (S,); smooth."""
    begin: float
    """[s]; free before."""
    end: float
    """[s]; free after, leaving with the path's velocity."""


def march(block: Block, parts: Elements, drive: Drive, times: np.ndarray, progress=None) -> np.ndarray:
    """Node positions [m], (T, N, 3), at evenly spaced `times` [s] beginning at rest at times[0].

    Raises Problem, naming time and node, when a position is not finite or an element turns inside out with FINER times
    the steps that are stable at rest.
    """
    frame = float(times[1] - times[0])
    substeps = math.ceil(frame / (SAFETY * stable_step(block.points, parts, block.fixed)))
    with suppress(Problem):
        return _march(block, parts, drive, times, substeps, progress)
    return _march(block, parts, drive, times, FINER * substeps, progress)


def _march(block: Block, parts: Elements, drive: Drive, times: np.ndarray, substeps: int, progress) -> np.ndarray:
    dt = float(times[1] - times[0]) / substeps
    x, v = block.points.copy(), np.zeros_like(block.points)
    positions = np.empty((len(times), *x.shape))
    positions[0] = x
    scratch = np.zeros_like(x)
    pull = dt / parts.mass
    pull[block.fixed] = 0.0
    grip = np.flatnonzero(block.gripped & ~block.fixed)
    for t in range(1, len(times)):
        ends = times[t - 1] + dt * np.arange(substeps + 1)
        held = (ends[1:] > drive.begin) & (ends[1:] <= drive.end + dt / 2)
        advance(x, v, block.points, pull, grip, drive.shift(ends), held, dt, *_arrays(parts), scratch)
        bad = ~np.isfinite(x).all(1)
        if bad.any():
            raise Problem(
                f"phantom: node {int(bad.argmax())} is not finite at {times[t]:.3f} s, with {substeps} steps a frame. "
                "Pull less far or more slowly, or use a stiffer or more viscous tissue."
            )
        squeezed = least_swelling(x, block.cells)
        if squeezed <= 0:
            raise Problem(
                f"phantom: an element is inside out at {times[t]:.3f} s. Pull less far or more slowly, or use a finer "
                "spacing."
            )
        positions[t] = x
        if progress:
            progress(t, len(times) - 1, "moving the tissue")
    return positions


def stable_step(points: np.ndarray, parts: Elements, fixed: np.ndarray) -> float:
    """Largest stable step [s] at rest.

    With the stiffness's highest circular frequency w and the viscosity's highest rate d (both found by
    power iteration on the assembled mesh), leapfrog with lagging viscous forces is stable for
    w^2 dt^2 + 2 d dt <= 4.
    """
    tiny = 1e-7 * np.ptp(points)
    rest = np.zeros_like(points)
    w2 = _largest(lambda a: _forces(points + tiny * a, rest, parts) / -tiny, parts.mass, fixed)
    d = _largest(lambda a: _forces(points, a, parts) * -1.0, parts.mass, fixed)
    return (math.sqrt(d * d + 4 * w2) - d) / w2


def least_swelling(x: np.ndarray, cells: np.ndarray) -> float:
    """Least determinant of d x / d xi over all Gauss points [m^3]; not positive where an element is inside out."""
    return float(np.linalg.det(np.tensordot(x[cells], SLOPES, ((1,), (1,))).swapaxes(1, 2)).min())


def _largest(apply, mass: np.ndarray, fixed: np.ndarray) -> float:
    """Largest eigenvalue of mass^-1 times a linear operator on nodal vectors."""
    a = np.random.default_rng(0).standard_normal((len(mass), 3))
    value = 0.0
    for _ in range(40):
        a[fixed] = 0.0
        a /= np.linalg.norm(a)
        a = apply(a) / mass[:, None]
        value = float(np.linalg.norm(a[~fixed]))
        if value == 0.0:
            break
    return 1.05 * value


def _forces(x: np.ndarray, v: np.ndarray, parts: Elements) -> np.ndarray:
    force = np.zeros_like(x)
    add_forces(x, v, *_arrays(parts), force)
    return force


def _arrays(parts: Elements) -> tuple[np.ndarray, ...]:
    return parts.cells, parts.inverse, parts.weight, parts.mu, parts.lam, parts.eta


@njit(cache=True, fastmath=FAST, error_model="numpy")
def advance(x, v, rest, pull, grip, path, held, dt, cells, inverse, weight, mu, lam, eta, force):
    """Take len(held) steps of dt [s] in place.

    `pull` is dt / mass of each node, 0 where fixed; `path` the displacement [m] of the nodes `grip`, rows s and
    s + 1 before and after step s, followed where `held`.
    """
    for s in range(len(held)):
        force[:] = 0.0
        add_forces(x, v, cells, inverse, weight, mu, lam, eta, force)
        for n in range(len(x)):
            for i in range(3):
                v[n, i] += pull[n] * force[n, i]
        if held[s]:
            for n in grip:
                for i in range(3):
                    v[n, i] = (path[s + 1, i] - path[s, i]) / dt
        for n in range(len(x)):
            for i in range(3):
                x[n, i] += dt * v[n, i]
        if held[s]:
            for n in grip:
                for i in range(3):
                    x[n, i] = rest[n, i] + path[s + 1, i]
