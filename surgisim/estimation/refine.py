"""Per-particle parameters by the adjoint, held together by total variation.

    L(s) = sum huber(tracks) / n + image L1 + smoothness mean_(j,k neighbours) (s_j - s_k)^2

s is the logarithm of each parameter relative to its uniform fit. The paper's eq. for L_v and L_tv;
ours keeps a refinement only where frames kept from it agree.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from surgisim.estimation.gauss_newton import WIDTH, misfit
from surgisim.estimation.observation import Observation
from surgisim.mpm.grip import Drive
from surgisim.mpm.simulator import Breakdown, Run, Simulator

BEGINS, LEAST, MOST = 0.1, 0.001, 0.5
"""Root mean square of the first step in the logarithm, of one below which none is tried any more, and of the longest;
chosen, as what follows."""
LONGER = 2.0
"""Times the last step, where the way down became steeper over it."""
SHORTER = (0.05, 0.5)
"""Times the step after one that does not fit better, between which, as a parabola has it; the latter where tissue
breaks."""
MEMORY = 8
"""How many of the last steps tell how the slope changes."""
SMOOTHED = 8
"""How often neighbours share their slope, so that a step is as smooth as the field it makes."""
STAYS = 1.0
"""How far around a place that broke tissue stays as it is, in grid cells."""
FIRMEST = 8.0
"""How many times stiffer than the uniform fit any part may become: beyond that it moves as one piece, and only makes
every step of every run after it shorter."""
TRIES = 3
"""Steps tried, at most, for each that may be kept."""
PAYS, OVER = 0.1, 3
"""Share of all that has been taken off the kept frames' misfit that the last so many steps must have taken off, or no
more are sought; chosen."""


@dataclass(frozen=True)
class Refined:
    """A field of parameters and whether it earned its place."""

    theta: np.ndarray
    """(P, M)"""
    kept: bool
    history: list[dict]


@dataclass(frozen=True)
class _Tried:
    """A field that was simulated."""

    s: np.ndarray
    theta: np.ndarray
    drive: Drive
    run: Run
    track: float
    image: float
    judged: float
    loss: float
    u_bar: np.ndarray
    """Derivative of the loss by the displacements, (T, A, 3)."""


def refine(
    simulator: Simulator,
    simulated: Callable[[np.ndarray], tuple[Drive, Run]],
    theta: np.ndarray,
    columns: list[int],
    observation: Observation,
    *,
    train: np.ndarray,
    judge: np.ndarray,
    image: Callable[[np.ndarray], tuple[float, np.ndarray]] | None,
    image_weight: float,
    iterations: int,
    smoothness: float,
    limits: tuple[np.ndarray, np.ndarray],
    neighbours: int = 6,
    progress: Callable[[float, float, str], None] = lambda *_: None,
) -> Refined:
    """Improve `columns` of theta (P, M) on frames `train`, and keep the best only if `judge` improves.

    simulated: what carries the tissue, at a step that a theta bears, and the run of it.
    image: from u (T, A, 3) to the image misfit and its derivative (T, A, 3), or None.
    limits: lowest and highest value of every column, (M,) each.
    """
    pairs = cKDTree(simulator.rest).query(simulator.rest, neighbours + 1)[1]
    own, other = np.repeat(pairs[:, 0], neighbours), pairs[:, 1:].ravel()

    even = theta[:, columns]
    low, high = np.log(limits[0][columns] / even), np.log(np.minimum(limits[1][columns] / even, FIRMEST))

    def tried(s: np.ndarray) -> _Tried:
        s, now = np.clip(s, low, high), theta.copy()
        now[:, columns] = even * np.exp(s)
        path, run = simulated(now)
        track, u_bar = _track_loss(observation, run.u, train)
        picture = 0.0
        if image is not None and image_weight > 0:
            picture, picture_bar = image(run.u)
            u_bar = u_bar + image_weight * picture_bar
        rough = smoothness * float(((s[own] - s[other]) ** 2).sum()) / len(own)
        judged = _track_loss(observation, run.u, judge)[0]
        return _Tried(s, now, path, run, track, picture, judged, track + image_weight * picture + rough, u_bar)

    def slope_at(at: _Tried) -> np.ndarray:
        """The loss's derivative by s, (P, M)."""
        slope = simulator.gradient(at.theta, at.drive, at.run, at.u_bar).theta[:, columns] * at.theta[:, columns]
        difference = 2 * smoothness * (at.s[own] - at.s[other]) / len(own)
        for c in range(at.s.shape[1]):
            slope[:, c] += np.bincount(own, difference[:, c], len(at.s))
            slope[:, c] -= np.bincount(other, difference[:, c], len(at.s))
        return slope

    begun = at = best = tried(np.zeros((len(theta), len(columns))))
    history = [_row(0, at)]
    free = np.ones((len(theta), 1))
    slope, past = slope_at(at), _Past(partial(_smoothed, pairs=pairs))

    def onward() -> np.ndarray:
        """The step down from here, (P, M); what is at its limit and would go beyond it stays there."""
        stays = ((at.s <= low) & (slope > 0)) | ((at.s >= high) & (slope < 0))
        return past.way(slope, free * ~stays)

    way, rate, tries, pays = onward(), 1.0, 0, True
    while pays and len(history) <= iterations and tries < TRIES * iterations:
        if rate * _size(way) < LEAST:
            if not past.steps:
                break
            # What the last steps told misleads here: begin anew, straight down.
            past.forget()
            way, rate = onward(), 1.0
            continue
        k, tries = len(history), tries + 1
        said = f"refinement {k}/{iterations}, misfit {at.track:.3f}, on kept frames {at.judged:.3f}"
        progress(k, iterations + 1, said)
        try:
            new = tried(at.s + rate * way)
        except Breakdown as breakdown:
            # A field that cannot be simulated is no candidate. Where it broke, tissue stays as it is from there on.
            if breakdown.particle is not None:
                away = np.linalg.norm(simulator.rest - simulator.rest[breakdown.particle], axis=1)
                stays = 1 - np.exp(-((away / (STAYS * simulator.grid.spacing)) ** 2))[:, None]
                free, way = free * stays, way * stays
            rate *= SHORTER[1]
            continue
        if new.loss >= at.loss:
            rate *= _shorter(rate * float((slope * way).sum()), new.loss - at.loss)
            continue
        before, steeper = at, slope
        at = new
        history.append(_row(k, at))
        best = min(best, at, key=lambda one: one.judged)
        lately = min(row["judged"] for row in history[:-OVER]) - best.judged if k >= OVER else np.inf
        pays = lately > PAYS * (begun.judged - best.judged)
        if pays and k < iterations:
            slope = slope_at(at)
            past.met(at.s - before.s, slope - steeper)
            way, rate = onward(), 1.0
    kept = best.judged < begun.judged * (1 - 0.01)
    return Refined(best.theta if kept else theta, bool(kept), history)


class _Past:
    """What the last steps told of how the slope changes.

    Limited-memory BFGS (Nocedal and Wright, Numerical optimization, 2nd ed., 2006, algorithm 7.4), which begins from a
    multiple of `smooth` where it usually does from one of the identity.
    """

    def __init__(self, smooth: Callable[[np.ndarray], np.ndarray]) -> None:
        self.smooth = smooth
        self.steps: deque[tuple[np.ndarray, np.ndarray]] = deque(maxlen=MEMORY)
        self.begins = BEGINS

    def met(self, step: np.ndarray, change: np.ndarray) -> None:
        """Over this step, (P, M), the slope changed by so much."""
        if (step * change).sum() > 0:
            self.steps.append((step, change))
        else:
            # It became steeper: there is no bottom to step to yet.
            self.steps.clear()
            self.begins = min(MOST, LONGER * _size(step))

    def forget(self) -> None:
        self.steps.clear()
        self.begins = BEGINS

    def way(self, slope: np.ndarray, free: np.ndarray) -> np.ndarray:
        """The step down from where the slope is this, (P, M); free: share of it that may be made, (P, M)."""
        way = self._toward_bottom(slope, free) if self.steps else None
        if way is None or (way * slope).sum() >= 0:
            way = -free * self.smooth(free * slope)
            return self.begins * way / (_size(way) + 1e-30)
        return way * min(1.0, MOST / _size(way))

    def _toward_bottom(self, slope: np.ndarray, free: np.ndarray) -> np.ndarray | None:
        """None where the past tells nothing of what is free."""
        told = [(free * step, free * change) for step, change in self.steps]
        told = [(step, change) for step, change in told if (step * change).sum() > 0]
        if not told:
            return None
        left, shares = free * slope, []
        for step, change in reversed(told):
            shares.append((step * left).sum() / (step * change).sum())
            left -= shares[-1] * change
        step, change = told[-1]
        way = free * self.smooth(left) * (step * change).sum() / (change * self.smooth(change)).sum()
        for (step, change), share in zip(told, reversed(shares), strict=True):
            way += step * (share - (change * way).sum() / (step * change).sum())
        return -way


def _smoothed(slope: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Slopes (P, M) as neighbours `pairs`, (P, N), share them."""
    for _ in range(SMOOTHED):
        slope = slope[pairs].mean(1)
    return slope


def _size(way: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt((way**2).mean()))


def _shorter(begins: float, ended: float) -> float:
    """Share of a step at which a parabola is lowest: `begins` is the change of the loss that the slope at its begin
    promises for the whole step, `ended` the one it made."""
    low, high = SHORTER
    return min(max(-begins / (2 * (ended - begins)), low), high) if begins < 0 else high


def _row(k: int, at: _Tried) -> dict:
    return {"iteration": k, "track": at.track, "image": at.image, "judged": at.judged}


def _track_loss(observation: Observation, u: np.ndarray, frames: np.ndarray):
    """Mean Huber misfit of the tracks at `frames` and its derivative by u, (T, A, 3)."""
    r = observation.residual(u, frames)
    count = max(1, int((observation.weight[:, frames] > 0).sum()))
    loss = misfit(r) / count
    slope = 2 * r / np.maximum(1.0, np.abs(r) / WIDTH) / count
    return loss, observation.pulled_back(slope, u, frames)
