"""Least squares over a few parameters, with derivatives from simulations run side by side."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from surgisim.problem import Problem

DIFFERENCE = 0.02
"""Step of the forward differences in search space: well above float32 noise, well below curvature."""


@dataclass(frozen=True)
class Solution:
    """Where the search ended."""

    x: np.ndarray
    """(M,)"""
    residual: np.ndarray
    """Weighted, at x, (R,)."""
    jacobian: np.ndarray
    """Its derivative by x, (R, M)."""
    history: list[dict] = field(default_factory=list)
    """x and cost after each iteration."""


def gauss_newton(
    residual: Callable[[np.ndarray, int], np.ndarray | None],
    x: np.ndarray,
    *,
    prior: np.ndarray,
    spread: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
    share: float,
    iterations: int,
    workers: int,
    said: Callable[[int, np.ndarray, float], None] = lambda *_: None,
) -> Solution:
    """Minimise share sum huber(r(x)) + sum ((x - prior) / spread)^2 by Levenberg-Marquardt.

    share: part of the residuals that counts as independent.

    residual(x, worker) may be called from `workers` threads at once, each with its own number; it
    returns None where x cannot be simulated, which only a trial step may meet.
    Nocedal and Wright, Numerical optimization, 2nd ed. (2006), section 10.3.
    """
    low, high = bounds
    damping, history = 1e-2, []
    with ThreadPoolExecutor(workers) as pool:

        def at_once(points):
            jobs = [pool.submit(_in_turn, residual, points[w::workers], w) for w in range(workers)]
            results = [None] * len(points)
            for w, job in enumerate(jobs):
                results[w::workers] = job.result()
            return results

        def jacobian_at(x, r):
            side = np.where(x + DIFFERENCE <= high, 1.0, -1.0) * DIFFERENCE
            shifted = at_once([x + side[m] * np.eye(len(x))[m] for m in range(len(x))])
            if any(s is None for s in shifted):
                raise Problem(
                    "estimation: the simulation breaks down a small step beside the current parameters. "
                    "Start from stiffer tissue (estimation.start), or check the grip."
                )
            return np.stack([(s - r) / side[m] for m, s in enumerate(shifted)], -1)

        r = residual(x, 0)
        if r is None:
            raise Problem(
                "estimation: the simulation breaks down at its start values. "
                "Start from stiffer tissue (estimation.start), or check the grip."
            )
        cost = _cost(r, x, prior, spread, share)
        J = jacobian_at(x, r)
        said(0, x, cost)
        for iteration in range(1, iterations + 1):
            w = share * _huber_weight(r)
            H = (J * w[:, None]).T @ J + np.diag(1 / spread**2)
            g = (J * w[:, None]).T @ r + (x - prior) / spread**2
            best = None
            for pair in ((0.1, 1.0), (10.0, 100.0)):
                trials = [
                    np.clip(x - np.linalg.solve(H + f * damping * np.diag(np.diag(H)), g), low, high) for f in pair
                ]
                results = at_once(trials)
                costs = [
                    np.inf if q is None else _cost(q, t, prior, spread, share)
                    for q, t in zip(results, trials, strict=True)
                ]
                k = int(np.argmin(costs))
                if costs[k] < cost:
                    best = (trials[k], results[k], costs[k], pair[k] * damping)
                    break
            if best is None:
                break
            moved = np.abs(best[0] - x).max()
            gained = (cost - best[2]) / max(cost, 1e-30)
            x, r, cost, damping = best[0], best[1], best[2], max(best[3], 1e-6)
            J = jacobian_at(x, r)
            history.append({"x": x.tolist(), "cost": cost})
            said(iteration, x, cost)
            if moved < 2e-3 or gained < 1e-4:
                break
    return Solution(x, r, J, history)


def scan(
    residual: Callable[[np.ndarray, int], np.ndarray | None],
    points: list[np.ndarray],
    *,
    prior: np.ndarray,
    spread: np.ndarray,
    share: float,
    workers: int,
) -> tuple[np.ndarray, list[float]]:
    """The best of a few starting points, and the cost at each (infinite where it cannot be simulated).

    A ring-down misfits by whole periods: from a modulus a few times too high, a descent ends there.
    """

    def costs(mine: list[np.ndarray], worker: int) -> list[float]:
        results = ((x, residual(x, worker)) for x in mine)
        return [np.inf if r is None else _cost(r, x, prior, spread, share) for x, r in results]

    with ThreadPoolExecutor(workers) as pool:
        jobs = [pool.submit(costs, points[w::workers], w) for w in range(workers)]
        all_costs = [np.inf] * len(points)
        for w, job in enumerate(jobs):
            all_costs[w::workers] = job.result()
    return points[int(np.argmin(all_costs))], all_costs


def _in_turn(residual, points, worker):
    return [residual(x, worker) for x in points]


def _huber_weight(r: np.ndarray, width: float = 2.0) -> np.ndarray:
    return 1 / np.maximum(1.0, np.abs(r) / width)


def _cost(r, x, prior, spread, share, width: float = 2.0) -> float:
    a = np.abs(r)
    huber = np.where(a <= width, a**2, 2 * width * a - width**2)
    return float(share * huber.sum() + (((x - prior) / spread) ** 2).sum())
