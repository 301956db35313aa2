"""What a residual may hold that is no tissue's physics: the camera's faults and the simulator's own error."""

import numpy as np

from surgisim.diagnosis.clip import Clip

LAG = 0.02
"""Standard deviation of the tracker's lag [s]."""
SCALE = 0.01
"""Of the depth's, or the recording's, scale [1]."""
DRIFT = 1e-4
"""Of a rigid drift over the clip [m]."""
RADII = (1.3, 1.6, 2.0, 3.0, 4.0, 6.0)
"""Rings around a grip, in its radii, to which SHARES belong."""
SHARES = (0.080, 0.060, 0.045, 0.030, 0.022, 0.014)
"""Standard deviation of the simulator's error along an axis, over how far the grip has carried the tissue: between the
engine and the phantom's finite elements on bodies without hidden physics (docs/diagnosis.md)."""
ALIKE = 0.008
"""Distance over which that error is alike [m]."""
FIRM = 0.15
"""Standard deviation of how much more or less than all of its path a grip carries along [1]."""
MODES = 24
"""Spatial patterns kept of it."""
BENT = 0.3
"""Share of it that grows with the square of the load instead."""
REBOUND = 0.5
"""Share of it that is left in the first frame after a release."""
FADES = 0.06
"""How fast that fades [s]."""


def camera(clip: Clip, simulated: np.ndarray) -> np.ndarray:
    """Lag, scale and rigid drift, each at one standard deviation [m], (C, K, T, 3), T the fitted frames."""
    frames = simulated.shape[1]
    velocity = np.gradient(simulated, axis=1) * clip.fps
    arm = clip.rest - clip.rest.mean(0)
    reach = max(float(np.sqrt((arm**2).sum(1).mean())), 1e-9)
    time = np.linspace(0, 1, frames)[None, :, None]
    drifts = [np.broadcast_to(DRIFT * time * e, simulated.shape) for e in np.eye(3)]
    drifts += [DRIFT * time * np.cross(e, arm / reach)[:, None] for e in np.eye(3)]
    return np.stack([LAG * velocity, SCALE * simulated, *drifts])


def grips(clip: Clip, near, frames: int) -> np.ndarray:
    """How firmly the grid carries a gripped ball along, at one standard deviation [m], (C, K, T, 3).

    A ball that is a little larger or smaller than it should be carries its surroundings by a constant share more or
    less; slipping, which begins at some moment, is not of that form.
    """
    result = []
    for j in range(len(clip.motion.radius)):
        active = clip.motion.active[j, :frames]
        if not active.any():
            continue
        path = np.where(active[:, None], clip.motion.position[j, :frames] - clip.motion.center_rest[j], 0.0)
        loads = near.anchored(1 + j).T
        states = near.at_states(np.broadcast_to(loads, (len(near.frames), *loads.shape)))
        parts = np.stack([near.over_time(states[:, d], np.ones(frames)) for d in range(3)])
        whole = np.einsum("dkti,td->kti", parts, path)
        share = np.linalg.norm(path, axis=1) / max(np.linalg.norm(path, axis=1).max(), 1e-9)
        result += [FIRM * whole, FIRM / 2 * whole * (2 * share - 1)[None, :, None]]
        reach = np.linalg.norm(path, axis=1)
        result += [FIRM / 2 * parts[d] * reach[None, :, None] for d in range(3)]
    return np.stack(result) if result else np.zeros((0, len(clip.kept), frames, 3))


def simulator(clip: Clip, frames: int, share: float = 1.0) -> np.ndarray:
    """Patterns of the simulator's error at one standard deviation [m], (C, K, T, 3).

    share: times what was measured.
    """
    motion, result = clip.motion, []
    for j in range(len(motion.radius)):
        active = motion.active[j, :frames]
        if not active.any():
            continue
        carried = np.where(active, np.linalg.norm(motion.position[j] - motion.center_rest[j], axis=-1)[:frames], 0.0)
        most = carried.max()
        if most <= 0:
            continue
        radii = np.linalg.norm(clip.rest - motion.center_rest[j], axis=1) / motion.radius[j]
        sd = share * np.exp(np.interp(np.log(radii), np.log(RADII), np.log(SHARES)))
        apart = np.linalg.norm(clip.rest[:, None] - clip.rest[None], axis=-1)
        values, axes = np.linalg.eigh(sd[:, None] * sd[None] * np.exp(-apart / ALIKE))
        order = np.argsort(values)[::-1][:MODES]
        patterns = axes[:, order] * np.sqrt(np.maximum(values[order], 0))
        since = np.arange(frames) - np.flatnonzero(active)[-1] - 1
        after = np.where(since >= 0, np.exp(-np.maximum(since, 0) / clip.fps / FADES), 0.0) * most * REBOUND
        courses = [(carried, MODES), (BENT * carried * (1 - carried / most) * 2, MODES // 2)]
        if after.any():
            courses.append((after, MODES // 2))
        for course, count in courses:
            for m in range(min(count, patterns.shape[1])):
                for e in np.eye(3):
                    result.append(patterns[:, m, None, None] * course[None, :, None] * e)
    return np.stack(result) if result else np.zeros((0, *clip.moved[:, :frames].shape))
