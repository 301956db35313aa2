"""How far two runs of one scene lie apart."""

import numpy as np

from surgisim.verification.manipulated.scene import FINE, FPS, PHASES, Hold, Scene

RINGS = {"in the grip": (0.0, 1.0), "1-1.6 radii": (1.0, 1.6), "1.6-3 radii": (1.6, 3.0), "beyond 3": (3.0, np.inf)}
NEAR = 1.6
"""Radii around the grip within which the rebound is watched."""


def rms(field: np.ndarray) -> float:
    """Root of the mean squared length of vectors (..., 3)."""
    return float(np.sqrt((field**2).sum(-1).mean()))


def compare(scene: Scene, found: np.ndarray, wanted: np.ndarray) -> dict:
    """Figures of displacements `found` against `wanted` [m], (T, K, 3) at the scene's clock; lengths in metres.

    Runs that end before the second grasp are compared as far as they go.
    """
    first = scene.holds[0]
    there, here = wanted[::FINE], found[::FINE]
    difference, phase = here - there, scene.phase()[: len(there)]
    away = np.linalg.norm(scene.probes() - first.grip.uv, axis=1) / first.grip.radius
    ends = [f for f in (scene.holds[1].begin, scene.frames - 1) if f < len(there)] or [len(there) - 1]
    times = [rebound(scene, first, run) for run in (found, wanted)]
    held = first.release
    rings = {}
    for name, (low, high) in RINGS.items():
        mine = (away >= low) & (away < high)
        rings[name] = {"motion": rms(there[held, mine]), "difference": rms(difference[held, mine])}
    return {
        "motion": rms(there),
        "difference": rms(difference),
        "share": rms(difference) / rms(there),
        "phases": {name: rms(difference[phase == k]) for k, name in enumerate(PHASES) if (phase == k).any()},
        "rings": rings,
        "lasting": float(np.linalg.norm(difference[ends], axis=-1).max()),
        "rebound": [t for t, _ in times],
        "overshoot": [size for _, size in times],
        "late": times[0][0] / times[1][0] - 1,
    }


def rebound(scene: Scene, hold: Hold, run: np.ndarray) -> tuple[float, float]:
    """When the tissue around the grip first turns back after its release [s], and where along the pull [m]."""
    along = curve(scene, hold, run)
    turns = np.flatnonzero((along[1:-1] < along[:-2]) & (along[1:-1] <= along[2:])) + 1
    if not len(turns):
        return float("nan"), float("nan")
    k = turns[0]
    bend = along[k - 1] - 2 * along[k] + along[k + 1]
    between = (along[k - 1] - along[k + 1]) / (2 * bend) if bend else 0.0
    return float((k + between) / FINE / FPS), float(along[k] - (along[k - 1] - along[k + 1]) * between / 4)


def curve(scene: Scene, hold: Hold, run: np.ndarray, frames: int = 6) -> np.ndarray:
    """Mean displacement along the pull of the points around the grip, from its release on [m], (frames FINE,)."""
    near = np.linalg.norm(scene.probes() - hold.grip.uv, axis=1) < NEAR * hold.grip.radius
    begin = hold.release * FINE
    return (run[begin : begin + frames * FINE, near] @ (hold.pull / np.linalg.norm(hold.pull))).mean(1)
