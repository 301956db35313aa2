"""What a fit takes for granted, and where its numbers would lie if that were otherwise.

Noise alone says too little of how sure a fit can be: a focal length that nobody gave, a surface whose slope was
guessed, an elastic law that was chosen and a rim that no camera sees bend every number, and the misfit hardly shows
it. Here the same clip is fitted again with each of these changed, by steps of the derivative that is already known.

What the clip cannot tell is changed by one standard deviation of its prior, and the numbers' answer counts as one of
theirs (consider parameters: Schmidt, Application of state-space methods to navigation problems, Advances in control
systems 3, 1966). What competes with what was chosen, as another law does, counts by how well it fits.
"""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from surgisim.artifacts.camera import Camera
from surgisim.estimation.gauss_newton import WIDTH, Solution, stepped
from surgisim.estimation.identify import overstated, spread_of
from surgisim.estimation.rounds import INDEPENDENT, cost_of
from surgisim.estimation.search import Search
from surgisim.estimation.support import edges_of
from surgisim.estimation.trial import Trial, at_once
from surgisim.estimation.view import View
from surgisim.mpm.setup import Prepared
from surgisim.physics.catalogue import catalogue

LENS = 0.3
"""Spread of the logarithm of a focal length that was assumed: endoscopes see 35 to 75 degrees across."""
SLOPE, BEND = 0.15, 0.4
"""Spread of a surface's slope, each way, and of its bend, where its shape was guessed from one view: on ten clips of
family 900 those of light alone are .02 to .27 and .02 to .44 off."""
PERIOD = 0.4
"""Over the number of cells through the tissue, how much too high a grid makes a modulus and a viscosity that are fitted
to a ring-down: twice what its periods are too long by, .056, .044 and .030 with 3.2, 4.6 and 6.4 cells
(docs/verification.md, "A pulled slab's periods"), and a little for a base that gives way. Its standard deviation is as
large: other pulls excite shorter waves, and those run late by 3 to 13 % with 4 cells."""
EDGE = 0.2
"""Standard deviation of how far tissue goes on beyond the picture, as a share of the depth that is expected."""
FARTHER = (-1.6, -0.8, 0.8, 1.6)
"""Logarithms of how many times stiffer tissue is tried beside the one found."""
BY_FAR = 2.0
"""Logarithm of how many times more probable a rival is that takes the fit's place."""
MOST_ODDS = 20.0
"""Largest logarithm of how many times more probable a rival can be."""
RESOLVED = 0.25
"""Standard deviation of where a grip's skin lies between particles, in their widths."""
DECAY = 0.42
"""Over the squared number of cells through the tissue, what a viscous body's decay is off by on a grid: a bent rod's by
.104, .047 and .026 with 2, 3 and 4 cells (docs/verification.md, "Decay of a viscous rod")."""
STEPS, ENOUGH = 4, 0.01
"""Most steps to where a fit lies otherwise, and the share of its cost that one must win for another."""
HOPELESS = 10.0
"""Logarithm of how many times less probable a rival is than the fit that is not followed any further."""
PARTS = (-1.0, 0.5, -0.5, 0.25, -0.25)
"""Shares of one standard deviation by which a thing is changed, in turn, where a whole one cannot be simulated: what it
does to the numbers is taken to be as many times larger. Of 69 clips 12 had such a one, and counted it as nothing."""
AS_IT_IS = "nothing"
"""What is changed where a fit is only brought to where these steps would bring it."""

Say = Callable[[float, float, str], None]
Make = Callable[..., Prepared]
"""Prepares a body under a motion; for other laws, and for other points that it carries, where those are given."""


@dataclass(frozen=True)
class Otherwise:
    """One thing that was taken for granted, changed."""

    about: str
    trial: Trial
    rival: bool = False
    """Whether it competes with what was chosen by how well it fits."""
    begin: np.ndarray | None = None
    """Where the fit begins, if not from the one that is asked about, (M,)."""
    view: View | None = None
    """How tissue lies in it, if otherwise."""
    open: np.ndarray | None = None
    """Which numbers are fitted anew, (M,) bool; all if None."""
    part: float = 1.0
    """Standard deviations by which it is changed, where it does not compete."""
    residual: np.ndarray | None = None
    """Weighted, where it begins, (R,); None where that is not known yet."""
    changed_by: Callable[[float], "Otherwise"] | None = None
    """The same changed by another part; None where there is but one way."""


@dataclass(frozen=True)
class Answer:
    """Where a fit lies when one thing is changed."""

    one: Otherwise
    x: np.ndarray
    """The numbers there, in search space, (M,)."""
    residual: np.ndarray | None
    """Weighted, (R,); None where it cannot be simulated."""
    cost: float
    jacobian: np.ndarray
    """The derivative by which it was reached, as the steps there have corrected it, (R, M)."""


def rivals(trial: Trial, x: np.ndarray) -> Iterator[Otherwise]:
    """What may take the place of a fit with a body laid for it that ended at x, (M,); first that itself, once more."""
    yield Otherwise(AS_IT_IS, trial, rival=True)
    laying = trial.laying
    for margin, rim in edges_of(trial.wanted.depth, laying.columns.spacing):
        if (margin, rim) != (laying.margin, laying.rim):
            yield Otherwise(
                f"{margin * 1e3:.0f} mm beyond the picture, {'held' if rim else 'free'}",
                replace(trial, laying=laying.ending(margin, rim)),
                rival=True,
            )
    flat = not laying.columns.flat
    other = replace(laying, columns=replace(laying.columns, flat=flat), kept={})
    yield Otherwise("flat base" if flat else "base that follows the surface", replace(trial, laying=other), rival=True)
    yield from _moduli(trial, x)


def otherwise(trial: Trial, x: np.ndarray, camera: Camera, points: np.ndarray, make: Make) -> Iterator[Otherwise]:
    """What else a fit with a body laid for it that ended at x, (M,), takes for granted, each changed; first nothing.

    points: what its grid reaches to at least [m], (Q, 3).
    """
    yield Otherwise(AS_IT_IS, trial)
    yield from _views(trial, x, camera, points, make)
    laying = trial.laying
    # Only whole columns can be added, so the change is the nearest to one standard deviation that there is.
    pitch = laying.columns.pitch.max()
    farther = laying.ending(laying.margin + max(1, round(EDGE * trial.wanted.depth.size / pitch)) * pitch, laying.rim)
    yield Otherwise("edge", replace(trial, laying=farther))
    yield from _laws(trial, make)


def on_no_grid(trial: Trial, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far the numbers lie from x without what a grid gets wrong, (M,), and the covariance of that, (M, M).

    A grid makes periods too long, and a fit makes tissue stiffer and more viscous for it. See PERIOD.
    """
    cells = trial.depth(x) / trial.stand(x)[0].bodies[0].body.spacing
    off = np.where([name.endswith((".E", ".eta")) for name in trial.wanted.names], -PERIOD / cells, 0.0)
    off[trial.differences == 0] = 0.0
    return off, np.outer(off, off)


def decay(trial: Trial, x: np.ndarray) -> np.ndarray:
    """Covariance of what the grid leaves open of a viscosity, in search space, (M, M): see DECAY."""
    cells = trial.depth(x) / trial.stand(x)[0].bodies[0].body.spacing
    off = DECAY / cells**2
    return np.diag([off**2 if name.endswith(".eta") else 0.0 for name in trial.wanted.names])


def resolution(trial: Trial, x: np.ndarray) -> np.ndarray:
    """Covariance of what particles leave open of where a grip's skin lies, in search space, (M, M)."""
    body = trial.stand(x)[0].bodies[0].body
    width = RESOLVED * float(np.cbrt(np.median(body.volume)))
    names = {u.name: width / u.size for u in trial.wanted.open if u.name.endswith((".radius", ".right", ".down"))}
    return np.diag([names.get(name, 0.0) ** 2 for name in trial.wanted.names])


def _moduli(trial: Trial, x: np.ndarray) -> Iterator[Otherwise]:
    """Stiffer and softer tissue, each with all else at its best: a ring-down is told by whole periods, in valleys."""
    if trial.eased is not None:
        return
    low, high = trial.wanted.bounds
    for k, (law, name, _) in enumerate(trial.wanted.free):
        if name != "E":
            continue
        for step in FARTHER:
            begin = x + step * np.array([n.endswith((".E", ".eta")) for n in trial.wanted.names])
            if low[k] <= begin[k] <= high[k]:
                about = f"{law} {np.exp(step):.2g} times as stiff"
                yield Otherwise(about, trial, True, begin=np.clip(begin, low, high), open=np.arange(len(x)) != k)


def _views(trial: Trial, x: np.ndarray, camera: Camera, points: np.ndarray, make: Make) -> Iterator[Otherwise]:
    changes: dict[str, dict[str, float]] = {}
    if camera.focal_from == "assumed":
        changes["focal length"] = {"lens": float(np.exp(LENS))}
    if not (trial.observation.weight[..., 2] > 0).any():
        changes |= {"slope across": {"right": SLOPE}, "slope down": {"down": SLOPE}, "bend": {"bowl": BEND}}
    yield from (_seen(trial, x, camera, points, make, about, change) for about, change in changes.items())


def _seen(
    trial: Trial, x: np.ndarray, camera: Camera, points: np.ndarray, make: Make, about: str, change: dict[str, float],
    part: float = 1.0,
) -> Otherwise:  # fmt: skip
    """What is seen in another view, changed by a part of the change; a lens's is a factor."""
    seen = trial.observation
    middle = np.median(seen.rest[:, :2] / seen.rest[:, 2:], axis=0)
    view = View(camera, middle, **{name: v**part if name == "lens" else v * part for name, v in change.items()})
    begin = np.clip(view.alike(x, trial.wanted), *trial.wanted.bounds)
    there = seen_as(trial, view, partial(make, carried=points * view.factor(points)))
    again = partial(_seen, trial, x, camera, points, make, about, change)
    return Otherwise(about, there, begin=begin, view=view, part=part, changed_by=again)


def seen_as(trial: Trial, view: View, make: Make) -> Trial:
    """The trial of the same recording in another view; make: as it prepares bodies there."""
    wanted, laying = trial.wanted, trial.laying
    if wanted.carrying:
        carrying = replace(wanted.carrying, motion=view.motion(wanted.carrying.motion), camera=view.seen_by)
        wanted = replace(wanted, carrying=carrying)
    observation = view.observation(trial.observation)
    laying = replace(
        laying, columns=view.columns(laying.whole), margin=0.0, observation=observation, make=make, kept={}
    )
    return replace(trial, wanted=wanted, motion=view.motion(trial.motion), observation=observation, laying=laying)


def _laws(trial: Trial, make: Make) -> Iterator[Otherwise]:
    """Every elastic law that has the same numbers as the chosen one."""
    wanted, known = trial.wanted, catalogue()
    for law in wanted.terms:
        for rival, term in known.items():
            same = term.energy is not None and term.params.keys() == known[law].params.keys()
            if same and rival not in wanted.terms and known[law].energy is not None:
                terms = tuple(rival if name == law else name for name in wanted.terms)
                free = tuple((rival if name == law else name, param, p) for name, param, p in wanted.free)
                base = {rival if name == law else name: values for name, values in wanted.base.items()}
                laying = replace(trial.laying, make=partial(make, terms=terms), kept={})
                changed = replace(wanted, terms=terms, free=free, base=base)
                yield Otherwise(rival, replace(trial, wanted=changed, laying=laying), rival=True)


def answers(solution: Solution, changed: list[Otherwise], say: Say, region: np.ndarray) -> list[Answer]:
    """Where the fit lies with each thing changed, in their order; say(done, of, what), region: as for `shares`.

    Rivals are followed as long as they may come near.
    """
    said = itertools.count(1)
    wanted = changed[0].trial.wanted
    near = cost_of(solution.residual, solution.x, wanted) + 2 * HOPELESS * _unit(solution, wanted, region)

    def of(one: Otherwise, worker: int) -> Answer:
        found = settled(one, solution, worker, near=near if one.rival else np.inf)
        for part in PARTS if one.changed_by else ():
            if found.residual is not None:
                break
            found = settled(one.changed_by(part), solution, worker)
        say(next(said), len(changed), f"if it were otherwise: {one.about}")
        return found

    return at_once(of, changed, changed[0].trial.workers)


def better(solution: Solution, wanted: Search, found: list[Answer], region: np.ndarray) -> Answer | None:
    """The rival that is more probable by far than this fit, if one is; region: as for `shares`."""
    best = min(found, key=lambda a: a.cost)
    gain = cost_of(solution.residual, solution.x, wanted) - best.cost
    return best if 0.5 * gain / _unit(solution, wanted, region) > BY_FAR else None


def shares(solution: Solution, wanted: Search, found: list[Answer], region: np.ndarray) -> list[float]:
    """How often each shift of the numbers counts, squared: a rival's probability, and 1 for what was changed by one
    standard deviation of its prior, more where by less.

    region: which errors may go together, (R,) int. Where parts of the tissue ask for different numbers, differences of
    the misfit tell less than they say; and that a lens, a slope or a rim fits a little better is no evidence for it:
    the shape of a simulated motion is not known that well (DEVIATIONS.md, "What is taken for granted").
    """
    cost, unit = cost_of(solution.residual, solution.x, wanted), _unit(solution, wanted, region)
    odds = [np.exp(min(0.5 * (cost - a.cost) / unit, MOST_ODDS)) if a.one.rival else 0.0 for a in found]
    return [
        float(odd / (1.0 + sum(odds))) if a.one.rival else a.one.part**-2 for a, odd in zip(found, odds, strict=True)
    ]


def _unit(solution: Solution, wanted: Search, region: np.ndarray) -> float:
    """What difference of costs is worth 1."""
    scale = spread_of(solution.residual)
    share = INDEPENDENT / scale
    return scale * overstated(solution.jacobian, solution.residual, share, wanted.spread, region)


def _weights(r: np.ndarray) -> np.ndarray:
    """How much each residual counts, (R,): less where it is large, as in the descent."""
    return INDEPENDENT / np.maximum(1.0, np.abs(r) / WIDTH)


def settled(
    one: Otherwise, solution: Solution, worker: int = 0, enough: float = ENOUGH, near: float = np.inf,
    steps: int = STEPS,
) -> Answer:  # fmt: skip
    """Where a fit near a solution lies otherwise, by a few steps of the derivative that was taken there.

    Each step corrects the derivative by what it met (Broyden's update, as in `gauss_newton`). enough: the share of the
    cost that a step must win for another. near: a cost that as many more steps as are left, each as good as the last
    one, must reach, or none is made. steps: most of them.
    """
    trial, wanted, J = one.trial, one.trial.wanted, solution.jacobian
    x = solution.x if one.begin is None else one.begin
    r = trial.residual(x, worker) if one.residual is None else one.residual
    if r is None:
        return Answer(one, x, r, np.inf, J)
    cost, damping, gained = cost_of(r, x, wanted), 0.01, np.inf
    for left in reversed(range(steps)):
        w = _weights(r)
        hessian = (J * w[:, None]).T @ J + np.diag(1 / wanted.spread**2)
        g = J.T @ (w * r) + (x - wanted.start) / wanted.spread**2
        at = stepped(x, hessian, g, damping, wanted.bounds, one.open)
        there = trial.residual(at, worker)
        if there is None:
            damping *= 30
            continue
        reached, moved = cost_of(there, at, wanted), at - x
        if moved.any():
            J = J + np.outer((there - r - J @ moved) / (moved @ moved), moved)
        if reached < cost:
            gained = cost - reached
            x, r, cost, damping = at, there, reached, 0.1 * damping
            if gained < enough * (cost + gained):
                break
        else:
            damping *= 30
        if cost - left * gained > near:
            break
    return Answer(one, x, r, cost, J)
