"""Where a descent begins: moduli read off the pace of a few ring-downs.

Tissue that is carried takes a shape whatever its modulus. Let go, it swings at a pace that goes with the root of its
modulus over its density, and its swing dies off with viscosity over the root of their product:
u(t; s^2 E, s eta) = u(s t; E, eta), t since it was let go. So one simulation tells every modulus at one damping, read
faster or slower. That leaves out weight, and what still swings when it is let go: the likeliest starts are simulated.
"""

import itertools
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.motion import Motion
from surgisim.estimation.rounds import RIVALS, cost_of, number, plain, unhurried
from surgisim.estimation.search import Search
from surgisim.estimation.trial import Trial, at_once
from surgisim.mpm.grip import runs
from surgisim.mpm.simulator import Breakdown, Run

STIFFEST = 0.8
"""Logarithm of how many times stiffer than where the search begins the tissue is whose ring-down is read."""
SOFTER = np.round(np.arange(-3.2, 0.01, 0.1), 3)
"""Logarithms of how many times stiffer than that others are: two periods of a ring-down are told from those of one a
fifth faster, so wider steps would pass between."""
DAMPING = (-0.6, 0.0, 0.6, 1.2, 1.8)
"""Logarithms of how many times more the swings are damped than where the search begins."""
OPENING = (-0.5, 0.0, 0.5)
"""How many frames later the tissue is let go."""
WITHIN = 4
"""States kept between two frames, to read a swing at another pace."""
NEXT = 1
"""Of SOFTER, how far from a valley's modulus it lies at the next of DAMPING."""
SIMULATED, READ = 5, 1.15
"""How many of the likeliest starts are simulated at most, and times the cost of the best, as read, up to which one may
be as good once it is simulated: of the embedded clip's, simulated ones cost .8 to 7 % more than read."""
APART = 0.35
"""Logarithm of how many times stiffer a start is from which it lies in another valley: a fifth faster, or more."""
FOLLOWED = 2
"""How many other valleys are followed at most."""

Say = Callable[[float, float, str], None]


@dataclass(frozen=True)
class Freed:
    """The longest stretch of a clip in which nothing holds tissue that was held before."""

    let_go: float
    """When it begins [frames]."""
    last: int
    """Its last frame."""

    @property
    def since(self) -> int:
        """A frame before it, however much earlier it may begin."""
        return max(0, int(self.let_go + min(OPENING)))


def choose_starts(trial: Trial, begin: np.ndarray, history: list, say: Say) -> list[np.ndarray]:
    """The best of many starting points, and those of other valleys that are about as good.

    What shapes a pull is as in `begin`, (M,), what paces a swing as tried. A ring-down misfits by whole periods: from a
    modulus a few times too high, a descent ends there. Raises Breakdown where none of the likeliest can be simulated.
    """
    wanted = trial.wanted
    begin = np.where(wanted.paces, wanted.start, begin)
    if trial.eased is not None:
        return [begin]
    free = freed(wanted.motion(begin, trial.motion), trial.frames)
    if free:
        say(0.13, 1.0, f"reading {len(SOFTER)} moduli off each of {len(DAMPING)} ring-downs")
        read = ring_downs(trial, begin, free)
        found = [x for _, x in _likely(valleys(wanted, begin, read))]
        points = list(itertools.chain(*_of_each_valley(found, wanted)))[:SIMULATED]
    if not free or not points:
        points = [np.clip(wanted.paced(begin, 0.0, damping), *wanted.bounds) for damping in DAMPING]
    say(0.2, 1.0, f"simulating {len(points)} starts")
    costs = [
        np.inf if r is None else cost_of(r, x, wanted) for r, x in zip(trial.together(points), points, strict=True)
    ]
    for x, cost in zip(points, costs, strict=True):
        history.append({"round": "start", "cost": number(cost)} | plain(wanted, x))
    if not np.isfinite(costs).any():
        raise Breakdown(
            "estimation: the body turns inside out under the recorded motion at every start. Check the grip and its "
            "path (tracking), or start from other values (estimation.start)."
        )
    near = [points[k] for k in np.argsort(costs) if costs[k] <= RIVALS * min(costs)]
    return _of_each_valley(near, wanted)[0][: 1 + FOLLOWED]


def _likely(found: Iterable[tuple[float, np.ndarray]]) -> list[tuple[float, np.ndarray]]:
    """Costs and places of the starts that are about as good as the best, as read, the best first."""
    near = sorted(found, key=lambda start: start[0])
    return [start for start in near if start[0] <= READ * near[0][0]]


def _of_each_valley(points: list[np.ndarray], wanted: Search) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Of points (M,) the first of every valley, and all others."""
    first: list[np.ndarray] = []
    others: list[np.ndarray] = []
    for x in points:
        new = all(wanted.log_modulus_ratio(x, one) > APART for one in first)
        (first if new else others).append(x)
    return first, others


def freed(motion: Motion, frames: int) -> Freed | None:
    """The longest stretch in which tissue swings freely; None where it is never let go."""
    if not len(motion.active) or not motion.active.any():
        return None
    held = motion.active.any(0)
    stretches = [(first, last) for first, last in runs(~held) if held[:first].any()]
    if not stretches:
        return None
    first, last = max(stretches, key=lambda s: s[1] - s[0])
    opens = max(first - 1 + motion.late[j] for j in range(len(motion.late)) if motion.active[j, first - 1])
    return Freed(float(opens), min(last, frames - 1))


def ring_downs(trial: Trial, begin: np.ndarray, free: Freed) -> list[tuple[np.ndarray, np.ndarray]]:
    """Cost of every modulus of SOFTER as read off one ring-down, and how many frames later tissue is let go where that
    is least, (S,) each, at each of DAMPING. Costs are infinite where the ring-down cannot be simulated.

    All begin in the state to which tissue is pulled that follows with hardly any inertia.
    """
    never = np.full(len(SOFTER), np.inf), np.zeros(len(SOFTER))
    try:
        pull = trial.run(unhurried(trial, begin), last=free.since)
    except Breakdown:
        return [never] * len(DAMPING)

    def at(damping: float, worker: int) -> tuple[np.ndarray, np.ndarray]:
        try:
            return _ring_down(trial, begin, pull, damping, free, worker)
        except Breakdown:
            return never

    return at_once(at, list(DAMPING), trial.workers)


def _ring_down(
    trial: Trial, begin: np.ndarray, pull: Run, damping: float, free: Freed, worker: int
) -> tuple[np.ndarray, np.ndarray]:
    wanted = trial.wanted
    cost, opening = np.full(len(SOFTER), np.inf), np.zeros(len(SOFTER))
    swing, observation = trial.closely(_place(wanted, begin, damping, 0.0, 0.0), pull, free.last, WITHIN, worker)
    for k, softer in enumerate(SOFTER):
        for later in OPENING if wanted.opens.any() else (0.0,):
            u = at_pace(pull.u, swing, free, float(np.exp(0.5 * softer)), later)
            x = _place(wanted, begin, damping, softer, later)
            one = cost_of(trial.judged(u, observation, free.last), x, wanted)
            if one < cost[k]:
                cost[k], opening[k] = one, later
    return cost, opening


def valleys(
    wanted: Search, begin: np.ndarray, read: list[tuple[np.ndarray, np.ndarray]]
) -> Iterator[tuple[float, np.ndarray]]:
    """Cost and place of every modulus that fits better than the next ones, of what was `read` at each of DAMPING.

    Dampings are tried far apart: one that fits better than those beside it is moved to where a parabola through their
    costs is lowest.
    """
    cost = np.array([costs for costs, _ in read])
    beside = np.pad(cost, ((0, 0), (1, 1)), constant_values=np.inf)
    least = np.isfinite(cost) & (cost <= np.minimum(beside[:, :-2], beside[:, 2:]))
    for d, m in zip(*np.nonzero(least), strict=True):
        # Tissue that is damped otherwise swings a little faster or slower.
        near = cost[:, max(0, m - NEXT) : m + NEXT + 1].min(1)
        damping = DAMPING[d]
        if 0 < d < len(DAMPING) - 1 and cost[d, m] < near[d - 1] < np.inf and cost[d, m] < near[d + 1] < np.inf:
            damping = _lowest(DAMPING[d - 1 : d + 2], (near[d - 1], cost[d, m], near[d + 1]))
        yield float(cost[d, m]), _place(wanted, begin, damping, SOFTER[m], read[d][1][m])


def _place(wanted: Search, begin: np.ndarray, damping: float, softer: float, later: float) -> np.ndarray:
    """Where tissue is so much damped, softer than STIFFEST and later let go, (M,)."""
    x = wanted.paced(wanted.paced(begin, STIFFEST, damping), softer)
    return np.clip(x + later * wanted.opens, *wanted.bounds)


def _lowest(at: tuple[float, float, float], costs: tuple[float, float, float]) -> float:
    """Where the parabola through three costs is lowest."""
    return float(np.polynomial.Polynomial.fit(at, costs, 2).deriv().roots()[0])


def at_pace(held: np.ndarray, swing: np.ndarray, free: Freed, pace: float, later: float) -> np.ndarray:
    """Displacements up to the last frame of `free` of tissue that swings `pace` times as fast, (T, A, 3).

    held: up to free.since, a state a frame; swing: from there on, WITHIN a frame, (., A, 3); later: how much later it
    is let go [frames].
    """
    frame = np.arange(free.since + 1, free.last + 1, dtype=float)
    begins = free.let_go + later
    clock = np.where(frame > begins, free.let_go + (frame - begins) * pace, np.minimum(frame, free.let_go))
    place = np.clip(WITHIN * (clock - free.since), 0, len(swing) - 1)
    below = np.minimum(place.astype(int), len(swing) - 2)
    part = (place - below)[:, None, None]
    return np.concatenate([held, (1 - part) * swing[below] + part * swing[below + 1]])
