"""The few numbers of a clip: which support, the shape of a pull, then descents over growing windows.

The paper restarts from frame 0 for every k further frames, which costs O(n^2). Here each round's
window is twice the last, so all rounds together cost at most twice the last one: O(n).
"""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.fft import dct

from surgisim.artifacts.motion import Motion
from surgisim.config.estimation import Estimation
from surgisim.estimation.bearing import borne, softer
from surgisim.estimation.gauss_newton import Solution, gauss_newton, misfit
from surgisim.estimation.observation import PHASES
from surgisim.estimation.search import Search
from surgisim.estimation.support import MIDDLE, SHARES, edges_of
from surgisim.estimation.trial import Trial, at_once
from surgisim.mpm.grip import runs
from surgisim.mpm.simulator import Breakdown
from surgisim.mpm.stable import shear_speed
from surgisim.physics.catalogue import choose

INDEPENDENT = 0.02
"""Share of residuals counted as independent: neighbouring points and frames share their tracking error."""
RATIOS = (0.40, 0.47)
"""Poisson's ratios at which supports are compared: both shape the spread of a load, so neither is judged alone."""
RIVALS = 1.1
"""Times the cost of the best up to which a start in another valley, or a descent from it, may yet end lower."""
NEARER = (0.0, -1.0, 1.0)
"""How much farther off than expected the grip ends there, in spreads of its prior."""
INERTIA = 0.005
"""Share of what a pull moves the tissue by that it may lag for its inertia, where its shape alone is asked for: at .02
a slab held 15 mm deep is found held 13.3 mm deep, at .005 14.5 mm, at the pace of its own modulus 14.7 mm."""
HEATS, FINALISTS = (2, 4), 2
"""Most iterations on the shape of a pull before its release is looked at: first with every edge, then with the best."""
FAR, LAGS = 0.95, 3
"""Share of its longest way from which a pull has shown its shape, and fitted frames more, in which tissue that lags
comes along; what is seen later shows it again."""
STEPPED = 3
"""Simulations that a descent has to run at once, on the whole: a few more for a derivative, two for a step."""
SETTLED = 4
"""Frames after a release that the first window must hold, or it says nothing of modulus and viscosity."""

Say = Callable[[float, float, str], None]


def hurry(trial: Trial, x: np.ndarray) -> float:
    """Logarithm of how many times stiffer at x the tissue is than it takes to follow what pulls it with hardly any
    inertia: 0 at least. Softer tissue takes the same shapes then, and longer steps.

    A body whose slowest swing has the frequency f1 lags what moves it at frequency f by (f / f1)^2 of that motion.
    """
    slowest = max((_slowest(path, trial.fps) for path in _paths(trial.motion)), default=np.inf)
    laws, values = choose(trial.bodies[0].terms), trial.wanted.values(x)
    alone = {name: law for name, law in laws.items() if law.energy is not None}
    found = shear_speed(alone, {name: law.row(values[name]) for name, law in alone.items()}, trial.bodies[0].density)
    return max(0.0, 2 * float(np.log(found / (4 * trial.depth(x) * slowest))))


def _paths(motion: Motion) -> Iterator[np.ndarray]:
    """Where each grip carries the tissue from where it takes it [m], (T, 3), each time it does."""
    for active, position in zip(motion.active, motion.position, strict=True):
        for first, last in runs(active):
            yield position[first : last + 1] - position[first]


def _slowest(path: np.ndarray, fps: float) -> float:
    """The lowest frequency [Hz] at which a body may swing that lags a path by no more than INERTIA of it."""
    power = (dct(path, norm="ortho", axis=0) ** 2).sum(1)
    frequency = np.arange(len(power)) * fps / (2 * len(power))
    tried = np.geomspace(max(frequency[:2]), 10 * fps, 200)
    lag = np.minimum(1.0, (frequency / tried[:, None]) ** 2)
    slow = (power * lag**2).sum(1) <= INERTIA**2 * power.sum()
    return float(tried[np.argmax(slow)])


def unhurried(trial: Trial, x: np.ndarray) -> np.ndarray:
    """x, or as much softer as does not change the shapes a pull gives, and not softer than may be searched."""
    return np.clip(trial.wanted.paced(x, -hurry(trial, x)), *trial.wanted.bounds)


def at_ease(trial: Trial) -> Trial:
    """The trial, in which tissue that nothing tells the pace of is simulated no stiffer than its pulls ask for.

    It is never let go, nothing else moves it, and no law remembers how long it has been pulled: it takes the same
    shapes, whatever its modulus, unless it is softer than is to be expected.
    """
    held = trial.motion.active
    free = (held[:, :-1] & ~held[:, 1:]).any()
    laws = choose(trial.bodies[0].terms).values()
    hurried = hurry(trial, trial.wanted.start)
    if free or not trial.calm or any(t.memory for t in laws) or not hurried:
        return trial
    return replace(trial, eased=-hurried)


def choose_support(trial: Trial, phase: np.ndarray, history: list, say: Say) -> tuple[list[Trial], np.ndarray]:
    """The trial with every edge, and the point to begin from with them.

    Depth, Poisson's ratio and how far the grip comes nearer all shape the spread of a load, so none is judged alone.
    They are chosen on the most expected edge. Which edge is right a pull's shape does not say before it is fitted: see
    `settle_pull`.
    """
    wanted, start = trial.wanted, unhurried(trial, trial.wanted.start)
    last = last_driven(trial, phase)
    if not last:
        return [trial], start
    ratios = [k for k, (_, p, _) in enumerate(wanted.free) if p == "nu"]
    nearer = [k for k, name in enumerate(wanted.names) if name.endswith(".toward")]
    points = []
    depths = np.log(np.array(SHARES) / MIDDLE)
    tried = itertools.product(depths, RATIOS if ratios else (None,), NEARER if nearer else (None,))
    for depth, value, share in tried:
        x = start.copy()
        x[wanted.names.index(wanted.depth.name)] = depth
        if ratios:
            x[ratios] = value
        if nearer:
            x[nearer] += share * wanted.spread[nearer]
        points.append(np.clip(x, *wanted.bounds))
    say(0.03, 1.0, f"comparing {len(points)} ways the body may be held")
    costs = at_once(partial(cost_until, last=last), [(trial, x) for x in points], trial.workers)
    x = points[int(np.argmin(costs))]
    found = edges_of(wanted.depth, trial.laying.columns.spacing)
    return [replace(trial, laying=trial.laying.ending(*end)) for end in found], x


def last_driven(trial: Trial, phase: np.ndarray) -> int:
    """The last fitted frame before a release, 0 if there is none."""
    driven = trial.fitted[phase[trial.fitted] < PHASES.index("release")]
    return int(driven[-1]) if len(driven) else 0


def _shown(trial: Trial, phase: np.ndarray) -> int:
    """The fitted frame before a release by which every grip has gone FAR of its longest way, and LAGS more."""
    last = last_driven(trial, phase)
    way = np.linalg.norm(trial.motion.position - trial.motion.center_rest[:, None], axis=-1)[:, : last + 1]
    gone = way * trial.motion.active[:, : last + 1]
    far = (gone >= FAR * gone.max(1, keepdims=True)).argmax(1).max(initial=0)
    return int(min(last, trial.fitted[min(np.searchsorted(trial.fitted, far) + LAGS, len(trial.fitted) - 1)]))


def cost_until(job: tuple[Trial, np.ndarray], worker: int = 0, *, last: int) -> float:
    """The misfit's share that counts, of a trial at x up to frame `last`; infinite where it cannot be simulated."""
    trial, x = job
    r = trial.residual(x, worker, last)
    return np.inf if r is None else INDEPENDENT * misfit(r)


def settle_pull(
    trials: list[Trial], x: np.ndarray, phase: np.ndarray, history: list, say: Say, jacobian: np.ndarray | None = None,
    iterations: int = HEATS[1],
) -> tuple[Trial, np.ndarray, np.ndarray | None]:  # fmt: skip
    """Of trials that differ by their edge the one whose pull and hold fit best, x with their shape fitted to them, and
    the derivative by what was fitted there, (R, N); None if there is none.

    How an edge fits before the shape is fitted with it says nothing: of family 31415's clip 17 the five edges' misfits
    were 2862 to 3605 then, and 828 to 1540 after, in another order.

    All is fitted but moduli, viscosities and moments of release: displacement-driven tissue takes its shape whatever
    its modulus, which only a release tells; where the shape is off, a release misfits by more than any modulus could
    mend, and the wrong one looks as good as the right one. The first trial and x where there is nothing to fit.
    jacobian: such a derivative, of a body that is held a little otherwise; iterations: of the best two.
    """
    wanted = trials[0].wanted
    last = _shown(trials[0], phase)
    slow = np.array([not name.endswith((".E", ".eta", ".release")) for name in wanted.names])
    if not last or not slow.any() or slow.all():
        return trials[0], x, jacobian
    # One alone needs no first heat.
    heats = [(len(trials), HEATS[0]), (FINALISTS, iterations)][len(trials) < 2 :]
    work, done = sum(entrants * iterations for entrants, iterations in heats), 0

    def settled(
        trial: Trial, begin: np.ndarray, jacobian: np.ndarray | None, iterations: int, done: int
    ) -> tuple[tuple[float, Trial, np.ndarray, np.ndarray | None], list]:
        rows: list = []

        def said(iteration: int, y: np.ndarray, cost: float) -> None:
            values = {n: float(f"{v:.4g}") for n, v in plain(wanted, y).items()}
            edge = {"beyond": trial.laying.margin, "rim": trial.laying.rim} if trial.laying else {}
            rows.append({"round": "pull", "last_frame": last, "iteration": iteration, "cost": cost} | edge | values)
            part = 0.06 * (1 + (done + iteration) / work)
            say(part, 1.0, f"shape of the pull, iteration {iteration}: {values}")

        try:
            found = _some(trial, begin, slow, last, iterations, said, jacobian)
        except Breakdown as breakdown:
            rows.append({"round": "pull", "last_frame": last, "cost": None, "broke": str(breakdown)})
            return (np.inf, trial, begin, jacobian), rows
        return (cost_of(found.residual, found.x, wanted), trial, found.x, found.jacobian), rows

    field: list[tuple[float, Trial, np.ndarray, np.ndarray | None]] = [(0.0, trial, x, jacobian) for trial in trials]
    for entrants, iterations in heats:
        jobs = [(*one[1:], iterations, done + n * iterations) for n, one in enumerate(field[:entrants])]
        run = led(settled, jobs, trials[0].workers)
        history += itertools.chain.from_iterable(rows for _, rows in run)
        field, done = sorted((one for one, _ in run), key=lambda one: one[0]), done + entrants * iterations
    return field[0][1:]


def led(settled: Callable[..., Any], jobs: list[tuple], workers: int) -> list[Any]:
    """settled(*job) of every job, in order; those without a derivative take the first one's, which is asked for first.

    A job is a trial, where it begins, a derivative, and what else is asked for; what comes of it begins with a tuple
    that ends in a derivative. Another edge bends how the pull's shape answers a little, which the steps correct.
    workers: of each trial; as many as hardly fill them go side by side.
    """
    first = settled(*jobs[0])
    shared = first[0][-1]

    def of(job: tuple, _: int) -> Any:
        trial, begin, own, *more = job
        return settled(trial, begin, shared if own is None else own, *more)

    return [first, *at_once(of, jobs[1:], max(1, workers // STEPPED))]


def _some(
    trial: Trial, x: np.ndarray, free: np.ndarray, last: int, iterations: int,
    said: Callable[[int, np.ndarray, float], None] = lambda *_: None, jacobian: np.ndarray | None = None,
) -> Solution:  # fmt: skip
    """Gauss-Newton from x up to frame `last` by some of the numbers only, (M,) bool; the derivative by those, (R, N).

    jacobian: such a one that is nearly right there already. Raises Breakdown where x, or a little beside it, cannot be
    simulated.
    """
    wanted = trial.wanted
    low, high = (end[free] for end in wanted.bounds)

    def whole(y: np.ndarray) -> np.ndarray:
        z = x.copy()
        z[free] = y
        return z

    found = gauss_newton(
        lambda y, worker: trial.residual(whole(y), worker, last), x[free], prior=wanted.start[free],
        spread=wanted.spread[free], differences=trial.differences[free], bounds=(low, high),
        share=INDEPENDENT, iterations=iterations, workers=trial.workers,
        said=lambda iteration, y, cost: said(iteration, whole(y), cost), renewed=False,
        together=lambda ys: trial.together([whole(y) for y in ys], last), jacobian=jacobian,
    )  # fmt: skip
    return replace(found, x=whole(found.x))


def descend(
    trial: Trial, x: np.ndarray, ends: list[int], settings: Estimation, history: list, say: Say,
    jacobian: np.ndarray | None = None, renewed: bool = True,
) -> tuple[Trial, Solution]:  # fmt: skip
    """Gauss-Newton from x over windows that end at these frames, the last at the last fitted one.

    What cannot be borne gives way from there on. jacobian: a derivative, (R, M), that is nearly right there already,
    where there is but one window. renewed: whether the derivative that is returned must have been taken at the end.
    """
    wanted = trial.wanted
    for k, last in enumerate(ends):
        # What fits a window may turn the tissue inside out in the next.
        (trial, _), solution = borne(trial, x, history, last), None
        while solution is None:

            def said(iteration, now, cost, k=k, last=last):
                nonlocal x
                x = now
                values = {n: float(f"{v:.4g}") for n, v in plain(wanted, x).items()}
                history.append({"round": k, "last_frame": int(last), "iteration": iteration, "cost": cost} | values)
                done = 0.25 + 0.3 * (k + iteration / settings.iterations) / len(ends)
                say(done, 1.0, f"round {k + 1}/{len(ends)}, iteration {iteration}: {values}")

            try:
                solution = gauss_newton(
                    partial(trial.residual, last=last),
                    x,
                    prior=wanted.start,
                    spread=wanted.spread,
                    differences=trial.differences,
                    bounds=wanted.bounds,
                    share=INDEPENDENT,
                    iterations=settings.iterations,
                    workers=trial.workers,
                    said=said,
                    together=partial(trial.together, last=last),
                    jacobian=jacobian,
                    renewed=renewed,
                )
            except Breakdown as breakdown:
                trial = softer(trial, x, history, breakdown)
        x = solution.x
    return trial, solution


@dataclass(frozen=True)
class _Run:
    """A descent from one start."""

    cost: float
    rows: list
    """Its history."""
    trial: Trial
    solution: Solution


def lowest(
    trial: Trial, starts: list[np.ndarray], ends: list[int], settings: Estimation, history: list, say: Say
) -> tuple[Trial, Solution]:
    """Of the descents from every start the one that ends lowest; the others' rounds are written down as rivals'.

    Those of several valleys go a step each first, by what paces a swing, and only what then costs at most RIVALS times
    what the best does is followed: a start is as far from its valley's floor as moduli and dampings were tried apart,
    which may hide which floor is lower. Raises Breakdown where none of them can be borne.
    """
    runs, broken = [], None
    if len(starts) > 1:
        starts = _stepped(trial, starts, ends[0], history, say)
    for n, x in enumerate(starts):

        def said(done: float, whole: float, text: str, n=n) -> None:
            # A descent tells of 0.25 to 0.55 of an estimation, which all of them share.
            say(0.25 + (0.3 * n + done - 0.25) / len(starts), whole, text if n == 0 else f"another valley, {text}")

        rows: list = []
        try:
            there, solution = descend(trial, x, ends, settings, rows, said)
        except Breakdown as breakdown:
            broken = breakdown
            continue
        runs.append(_Run(cost_of(solution.residual, solution.x, trial.wanted), rows, there, solution))
    if not runs:
        raise broken
    best = min(runs, key=lambda run: run.cost)
    for run in runs:
        history += run.rows if run is best else [row | {"round": "rival"} for row in run.rows]
    return best.trial, best.solution


def _stepped(trial: Trial, starts: list[np.ndarray], last: int, history: list, say: Say) -> list[np.ndarray]:
    """Starts a step nearer to their valleys' floors, the cheapest first, without those that cost more than RIVALS times
    what the best does, whose costs are written down."""
    wanted = trial.wanted
    free = wanted.paces | wanted.opens
    found = []
    for n, x in enumerate(starts, 1):
        say(0.25, 1.0, f"a step in each of {len(starts)} valleys: {n}")
        try:
            step = _some(trial, x, free, last, 1)
        except Breakdown:
            # Where all break, a descent yet meets it with softer grips.
            found.append((np.inf, x))
        else:
            found.append((cost_of(step.residual, step.x, wanted), step.x))
    found.sort(key=lambda start: start[0])
    near = [cost <= RIVALS * found[0][0] for cost, _ in found]
    history += [
        {"round": "rival", "last_frame": last, "cost": number(cost)} | plain(wanted, x)
        for (cost, x), on in zip(found, near, strict=True)
        if not on
    ]
    return [x for (_, x), on in zip(found, near, strict=True) if on]


def windows(fitted: np.ndarray, phase: np.ndarray, share: float) -> list[int]:
    """Last frames of the rounds: each window twice the one before, and the first holds all of a pull and its release.

    A shorter one leaves a pull's shape, which is known by then, for one that only its beginning bears out.
    """
    end = int(fitted[-1])
    released = np.flatnonzero(phase[: end + 1] == PHASES.index("release"))
    first = max(int(released[0] + SETTLED if len(released) else end), int(share * end))
    ends = [end]
    while ends[0] // 2 >= first:
        ends.insert(0, int(fitted[np.searchsorted(fitted, ends[0] // 2)]))
    return ends


def plain(wanted: Search, x: np.ndarray) -> dict[str, float]:
    """'law.parameter' -> value at x."""
    values = wanted.values(x)
    laws = {f"{law}.{param}": values[law][param] for law, param, _ in wanted.free}
    return laws | {u.name: float(v) for u, v in zip(wanted.open, x[len(wanted.free) :], strict=True)}


def cost_of(r: np.ndarray, x: np.ndarray, wanted: Search) -> float:
    """What a descent minimises: the misfit's share that counts, and how far x lies from its prior."""
    return INDEPENDENT * misfit(r) + float((((x - wanted.start) / wanted.spread) ** 2).sum())


def number(value: float) -> float | None:
    """JSON has no NaN and no infinity: a number that could not be had is null."""
    return float(value) if np.isfinite(value) else None
