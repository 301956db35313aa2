"""Per-particle parameters by the adjoint, held together by total variation.

    L(s) = sum huber(tracks) / n + image L1 + smoothness mean_(j,k neighbours) (s_j - s_k)^2

s is the logarithm of each parameter relative to its uniform fit. The paper's eq. for L_v and L_tv;
ours keeps a refinement only where frames kept from it agree.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from surgisim.estimation.gauss_newton import WIDTH, misfit
from surgisim.estimation.observation import Observation
from surgisim.mpm.grip import Drive
from surgisim.mpm.simulator import Breakdown, Simulator

RATE = 0.08
"""Adam's step in the logarithm."""
PATIENCE = 3
"""Steps in a row without a better fit of the kept frames after which no more are made."""


@dataclass(frozen=True)
class Refined:
    """A field of parameters and whether it earned its place."""

    theta: np.ndarray
    """(P, M)"""
    kept: bool
    history: list[dict]


def refine(
    simulator: Simulator,
    drive: Drive,
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

    image: from u (T, A, 3) to the image misfit and its derivative (T, A, 3), or None.
    limits: lowest and highest value of every column, (M,) each.
    """
    pairs = cKDTree(simulator.rest).query(simulator.rest, neighbours + 1)[1]
    own, other = np.repeat(pairs[:, 0], neighbours), pairs[:, 1:].ravel()
    s = np.zeros((len(theta), len(columns)))
    first, second = np.zeros_like(s), np.zeros_like(s)
    best_s, best_judged, best_k, history = s, np.inf, 0, []
    begun = np.inf
    for k in range(iterations + 1):
        now = theta.copy()
        now[:, columns] = np.clip(theta[:, columns] * np.exp(s), limits[0][columns], limits[1][columns])
        try:
            run = simulator.run(now, drive)
        except Breakdown:
            # A field that cannot be simulated is no candidate; the best one so far stands.
            break
        judged = _track_loss(observation, run.u, judge)[0]
        track, u_bar = _track_loss(observation, run.u, train)
        picture = 0.0
        if image is not None and image_weight > 0:
            picture, picture_bar = image(run.u)
            u_bar = u_bar + image_weight * picture_bar
        history.append({"iteration": k, "track": track, "image": picture, "judged": judged})
        progress(k, iterations, f"refinement {k}/{iterations}, misfit {track:.3f}, on kept frames {judged:.3f}")
        begun = judged if k == 0 else begun
        if judged < best_judged:
            best_s, best_judged, best_k = s.copy(), judged, k
        if k == iterations or k - best_k >= PATIENCE:
            break
        gradient = simulator.gradient(now, drive, run, u_bar).theta[:, columns] * now[:, columns]
        difference = s[own] - s[other]
        smooth = np.zeros_like(s)
        for c in range(s.shape[1]):
            flow = 2 * smoothness * difference[:, c] / len(own)
            smooth[:, c] = np.bincount(own, flow, len(s)) - np.bincount(other, flow, len(s))
        gradient = gradient + smooth
        # Neighbours share their gradient, so that a step is as smooth as the field it makes.
        for _ in range(8):
            gradient = gradient[pairs].mean(1)
        first = 0.8 * first + 0.2 * gradient
        second = 0.9 * second + 0.1 * (gradient**2).mean(0)
        s = s - RATE * (first / (1 - 0.8 ** (k + 1))) / (np.sqrt(second / (1 - 0.9 ** (k + 1))) + 1e-30)
    kept = best_judged < begun * (1 - 0.01)
    final = theta.copy()
    if kept:
        final[:, columns] = np.clip(theta[:, columns] * np.exp(best_s), limits[0][columns], limits[1][columns])
    return Refined(final, bool(kept), history)


def _track_loss(observation: Observation, u: np.ndarray, frames: np.ndarray):
    """Mean Huber misfit of the tracks at `frames` and its derivative by u, (T, A, 3)."""
    r = observation.residual(u, frames)
    count = max(1, int((observation.weight[:, frames] > 0).sum()))
    loss = misfit(r) / count
    slope = 2 * r / np.maximum(1.0, np.abs(r) / WIDTH) / count
    return loss, observation.pulled_back(slope, u, frames)
