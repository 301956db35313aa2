"""Least squares over a few parameters, with derivatives from simulations run side by side."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np

from surgisim.estimation.trial import at_once
from surgisim.mpm.simulator import Breakdown

RENEWED = 0.05
"""Share of the cost a step must win, or the derivative is taken anew."""
SMALLER = (4.0, 16.0)
"""How many times smaller steps are where a body that hardly bears what pulls it breaks down beside where it is."""
DAMPED = ((0.1, 1.0), (10.0, 100.0)), ((1e3, 1e4),)
"""Times its damping with which a step is tried, two side by side; and where the derivative was just taken and none of
them lowers the cost."""
WIDTH = 2.0
"""Standard deviations beyond which a residual counts linearly: a lost track must not bend a modulus."""


@dataclass(frozen=True)
class Solution:
    """Where the search ended."""

    x: np.ndarray
    """(M,)"""
    residual: np.ndarray
    """Weighted, at x, (R,)."""
    jacobian: np.ndarray
    """Its derivative by x, (R, M)."""


def gauss_newton(
    residual: Callable[[np.ndarray, int], np.ndarray | None],
    x: np.ndarray,
    *,
    prior: np.ndarray,
    spread: np.ndarray,
    differences: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
    share: float,
    iterations: int,
    workers: int,
    said: Callable[[int, np.ndarray, float], None] = lambda *_: None,
    together: Callable[[list[np.ndarray]], list[np.ndarray | None]] | None = None,
    jacobian: np.ndarray | None = None,
    renewed: bool = True,
) -> Solution:
    """Minimise share sum huber(r(x)) + sum ((x - prior) / spread)^2 by Levenberg-Marquardt.

    share: part of the residuals that counts as independent. differences: steps of the derivative, (M,).

    residual(x, worker) may be called from `workers` threads at once, each with its own number; it
    returns None where x cannot be simulated, which only a trial step may meet. together(xs) gives the residuals of
    several x at once, where that is quicker. jacobian: a derivative, (R, M), nearly right at x, to begin with.
    renewed: whether the derivative that is returned must have been taken at the end, or a last, small step before it.
    Nocedal and Wright, Numerical optimization, 2nd ed. (2006), section 10.3; between derivatives by differences, which
    cost a simulation a number, Broyden's update (ibid., section 11.1). A number at a bound that the cost would drive
    beyond it stays there, and the others step as if it were known (Bertsekas, Projected Newton methods, SIAM J. Control
    Optim. 20, 1982): cut from a step of all, it leaves one that need not lead down.
    """
    damping = 1e-2

    def all_of(xs: list[np.ndarray]) -> list[np.ndarray | None]:
        return together(xs) if together else at_once(residual, xs, workers)

    def jacobian_at(x: np.ndarray, r: np.ndarray) -> np.ndarray:
        return derivative(all_of, x, r, differences, bounds)

    def cost_of(r: np.ndarray | None, x: np.ndarray) -> float:
        return np.inf if r is None else share * misfit(r) + float((((x - prior) / spread) ** 2).sum())

    r = residual(x, 0)
    if r is None:
        raise Breakdown(
            "estimation: the simulation breaks down at its start values. "
            "Start from stiffer tissue (estimation.start), or check the grip."
        )
    cost, fresh = cost_of(r, x), jacobian is None
    J = jacobian_at(x, r) if fresh else jacobian
    said(0, x, cost)
    for iteration in range(1, iterations + 1):
        best = None
        while best is None:
            w = share / np.maximum(1.0, np.abs(r) / WIDTH)
            H = (J * w[:, None]).T @ J + np.diag(1 / spread**2)
            g = (J * w[:, None]).T @ r + (x - prior) / spread**2
            pairs = [*DAMPED[0], *(DAMPED[1] if fresh else ())]
            # As many pairs as there are workers for are tried at once, and the first that leads down is taken.
            abreast = max(1, workers // len(pairs[0]))
            for k in range(0, len(pairs), abreast):
                factors = list(chain.from_iterable(pairs[k : k + abreast]))
                trials = [stepped(x, H, g, f * damping, bounds) for f in factors]
                results = all_of(trials)
                costs = [cost_of(q, t) for q, t in zip(results, trials, strict=True)]
                lower = next((n for n in _lowest_of(costs, len(pairs[0])) if costs[n] < cost), None)
                if lower is not None:
                    best = (trials[lower], results[lower], costs[lower], factors[lower] * damping)
                    break
            if best is None and fresh:
                return Solution(x, r, J)
            if best is None:
                J, fresh = jacobian_at(x, r), True
        moved, gained = best[0] - x, (cost - best[2]) / max(cost, 1e-30)
        # Broyden's update: a derivative that agrees with the step just made costs no further simulations.
        taken, J = J, J + np.outer((best[1] - r - J @ moved) / (moved @ moved), moved)
        x, r, cost, damping = best[0], best[1], best[2], max(best[3], 1e-6)
        said(iteration, x, cost)
        if iteration == iterations and not renewed:
            return Solution(x, r, J)
        small = np.abs(moved).max() < 5e-3 or gained < 3e-4
        if small and fresh:
            return Solution(x, r, taken)
        # One that was just taken is followed a step farther before it is taken again.
        stale = not fresh and (small or gained < RENEWED)
        J, fresh = (jacobian_at(x, r), True) if stale else (J, False)
    return Solution(x, r, J if fresh or not renewed else jacobian_at(x, r))


def _lowest_of(costs: list[float], size: int) -> Iterator[int]:
    """Of so many costs after one another each time, where the lowest is."""
    for k in range(0, len(costs), size):
        yield k + int(np.argmin(costs[k : k + size]))


def stepped(
    x: np.ndarray,
    H: np.ndarray,
    g: np.ndarray,
    damping: float,
    bounds: tuple[np.ndarray, np.ndarray],
    free: np.ndarray | None = None,
) -> np.ndarray:
    """Where a damped step leads from x, (M,), within the bounds; free: numbers that may change, (M,) bool, all if None.

    H, g: second derivative, (M, M), and first, (M,), of half of the cost.
    """
    low, high = bounds
    moves = ~(((x <= low) & (g > 0)) | ((x >= high) & (g < 0)))
    if free is not None:
        moves &= free
    step, mine = np.zeros_like(x), H[np.ix_(moves, moves)]
    step[moves] = np.linalg.solve(mine + damping * np.diag(np.diag(mine)), g[moves])
    return np.clip(x - step, low, high)


def derivative(
    together: Callable[[list[np.ndarray]], list[np.ndarray | None]],
    x: np.ndarray,
    r: np.ndarray,
    differences: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """Derivative of the residuals r, (R,), at x, (M,), by differences of these sizes, (R, M).

    A difference of 0 stands for a number that makes none. together(xs): the residuals of several x. Where neither side
    of a number can be simulated, smaller steps are tried (SMALLER); raises Breakdown where none of them can.
    """
    low, high = bounds
    side = np.where(x + differences <= high, 1.0, -1.0) * differences
    asked = np.flatnonzero(side)
    shifted = dict(zip(asked, together(list(x + np.diag(side)[asked])), strict=True))
    for m in [m for m, s in shifted.items() if s is None]:
        whole = side[m]
        for part in (-1.0, *(sign / times for times in SMALLER for sign in (1.0, -1.0))):
            at = np.clip(x + part * whole * np.eye(len(x))[m], low, high)
            side[m] = at[m] - x[m]
            (shifted[m],) = together([at]) if side[m] else (None,)
            if shifted[m] is not None:
                break
    if any(s is None for s in shifted.values()):
        raise Breakdown(
            "estimation: the simulation breaks down a small step beside the current parameters. "
            "Start from stiffer tissue (estimation.start), or check the grip."
        )
    J = np.zeros((len(r), len(x)))
    for m, s in shifted.items():
        J[:, m] = (s - r) / side[m]
    return J


def misfit(r: np.ndarray) -> float:
    """Sum of Huber's function of the residuals: squares up to WIDTH, straight lines beyond."""
    a = np.abs(r)
    return float(np.where(a <= WIDTH, a**2, 2 * WIDTH * a - WIDTH**2).sum())
