"""How the simulated tissue would move were what a fit leaves open otherwise by one standard deviation.

What diagnoses a clip must not take a wrong lens, a body held too deep or a grip that comes nearer than was found for
physics that was left out. Its own base has the laws' numbers and the moment of release; the rest is told here.
"""

from collections.abc import Mapping

import numpy as np

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.doubts import Doubts
from surgisim.artifacts.tracks import Tracks
from surgisim.estimation.identify import NINETY
from surgisim.estimation.otherwise import Otherwise
from surgisim.estimation.search import Search
from surgisim.estimation.trial import Trial, at_once
from surgisim.estimation.view import View
from surgisim.mpm.simulator import Breakdown

ON_BODY = 0.05
"""How far from 1 the weights of a point on the body may sum."""


def doubts(
    trial: Trial, x: np.ndarray, spread: Mapping[str, float], others: list[Otherwise], tracks: Tracks, camera: Camera
) -> Doubts:
    """Of a fit with a body laid for it that ended at x, (M,), for every tracked point; zero where it is off the body.

    spread: standard deviation of what is open beside the laws, by its name, in search space. others: what the fit takes
    for granted, changed by a part of a standard deviation each.
    """
    low, high = trial.wanted.bounds
    jobs: list[tuple[str, Trial, np.ndarray, View | None]] = [("", trial, x, None)]
    for k, name in enumerate(trial.wanted.names):
        if name in spread and not name.endswith(".release"):
            step = spread[name] * np.eye(len(x))[k]
            # At the end of its range nothing would change on one side.
            side = 1.0 if x[k] < 0.5 * (low[k] + high[k]) else -1.0
            jobs.append((name, trial, np.clip(x + side * step, low, high), None))
    jobs += [(one.about, one.trial, x if one.begin is None else one.begin, one.view) for one in others]

    def of(job: tuple, worker: int) -> np.ndarray | None:
        _, there, at, view = job
        try:
            return seen(there, at, tracks, camera, view, worker)
        except Breakdown:
            return None

    here, *there = at_once(of, jobs, trial.workers)
    parts = [1.0] * (len(jobs) - 1 - len(others)) + [one.part for one in others]
    each = zip(jobs[1:], there, parts, strict=True)
    kept = [(name, (way - here) / part) for (name, *_), way, part in each if way is not None]
    moved = np.stack([way for _, way in kept]) if kept else np.zeros((0, *here.shape))
    return Doubts(np.array([name for name, _ in kept], dtype=str), moved.astype(np.float32))


def none(tracks: Tracks) -> Doubts:
    """No doubts, where nothing was fitted."""
    return Doubts(np.array([], dtype=str), np.zeros((0, *tracks.xyz.shape), np.float32))


def spreads(wanted: Search, table: Mapping[str, dict]) -> dict[str, float]:
    """Standard deviation in search space of what is open beside the laws, from the intervals of a table."""
    found = {}
    for u in wanted.open:
        low, high = (table[u.name][end] for end in ("low", "high"))
        found[u.name] = float(np.log(high / low) if u.logarithmic else (high - low) / u.size) / (2 * NINETY)
    return found


def seen(
    trial: Trial, x: np.ndarray, tracks: Tracks, camera: Camera, view: View | None = None, worker: int = 0
) -> np.ndarray:
    """How far every tracked point goes at x, as its pixel shows it, camera frame [m], (K, T, 3).

    view: how the trial's tissue lies, if otherwise than the tracks say.
    """
    rest = tracks.xyz[:, 0].astype(float)
    known = np.isfinite(rest).all(1)
    rest = np.where(known[:, None], rest, np.nanmean(rest, 0))
    lies, through = (rest * view.factor(rest), view.seen_by) if view else (rest, camera)
    run = trial.run(x, worker)
    simulator = trial.stand(x, worker)[0].bodies[worker].simulator
    carry = simulator.carry(lies)
    known &= abs(simulator.support(carry) - 1) < ON_BODY
    moved = np.stack([carry @ u.astype(float) for u in run.u], 1)
    pixels = through.project(lies[:, None] + moved)
    return np.where(known[:, None, None], as_shown(rest, pixels - pixels[:, :1], moved[..., 2], camera), 0.0)


def as_shown(rest: np.ndarray, shift: np.ndarray, along: np.ndarray, camera: Camera) -> np.ndarray:
    """Displacement, camera frame [m], (K, T, 3), of points at `rest`, (K, 3), whose pixels shift so [px], (K, T, 2).

    along: how much farther off they go [m], (K, T), which stays in their pixel: along the ray, not along z.
    """
    across = shift * rest[:, None, 2:] / [camera.fx, camera.fy]
    flat = np.concatenate([across, np.zeros_like(across[..., :1])], -1)
    return flat + along[..., None] * (rest / rest[:, 2:])[:, None]
