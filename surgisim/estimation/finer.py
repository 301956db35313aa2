"""A fit brought to a finer grid, on which a ring-down's shorter waves run as fast as they should."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from surgisim.estimation.bearing import with_margin
from surgisim.estimation.gauss_newton import Solution, derivative
from surgisim.estimation.otherwise import STEPS, Otherwise, on_no_grid, settled
from surgisim.estimation.rounds import number, plain
from surgisim.estimation.trial import WORKERS, Trial
from surgisim.mpm.setup import Values
from surgisim.mpm.simulator import Breakdown, Run

FINER, NEARLY = 1.5, 2e-3
"""How many times finer the grid is that a fit ends on, and the share of its cost that a step must win there at last;
the latter chosen on the embedded clip, whose last steps win .3, .1, .1 and .4 % and make E 2.4 % lower together."""
BROKE = "what fits on the wider grid cannot be simulated on a finer one"
"""What `history` says where a fit stays on the wider grid."""

Say = Callable[[float, float, str], None]


def finely(trial: Trial, solution: Solution, history: list, say: Say) -> tuple[Trial, Solution]:
    """The fit on a finer grid; the same one, with a line in `history`, where that cannot be simulated.

    The first steps go by the wider grid's derivative. Then what paces waves gets one of its own, unless nothing tells
    their pace; how tissue is carried, how deep it is held and how its volume gives way moves it alike on both grids.
    """
    fine = replace(trial, laying=trial.laying.finer(FINER))
    # Steps are simulated one after another, so each has all the threads.
    alone, wanted = replace(fine, laying=fine.laying.shared(WORKERS)), trial.wanted
    change = on_no_grid(fine, solution.x)[0] - on_no_grid(trial, solution.x)[0]
    begin = np.clip(solution.x - change, *wanted.bounds)
    say(0.0, 1.0, "on a finer grid")
    # Where nothing tells the pace it is only asked how far a grid is off: the way of one step says that.
    steps = STEPS if trial.eased is None else 1
    found = settled(Otherwise("finer grid", alone, begin=begin), solution, steps=steps)
    if found.residual is None:
        # A finer grid follows a sharper fold, and can turn inside out where a wider one does not.
        history.append({"round": "finer grid", "cost": None, "broke": BROKE})
        return trial, solution
    if trial.eased is not None:
        return fine, replace(solution, x=found.x, residual=found.residual)
    say(0.4, 1.0, f"on a finer grid: {plain(wanted, found.x)}")
    try:
        waves = np.where(wanted.paces, fine.differences, 0.0)
        own = derivative(fine.together, found.x, found.residual, waves, wanted.bounds)
    except Breakdown as breakdown:
        history.append({"round": "finer grid", "cost": None, "broke": str(breakdown)})
        return trial, solution
    here = Solution(found.x, found.residual, np.where(wanted.paces, own, found.jacobian))
    found = settled(Otherwise("finer grid", alone, begin=found.x, residual=found.residual), here, enough=NEARLY)
    history.append({"round": "finer grid", "cost": number(found.cost)} | plain(wanted, found.x))
    return fine, replace(here, x=found.x, residual=found.residual)


def brought(field: np.ndarray, coarse: Trial, uniform: Values, trial: Trial, values: Values) -> np.ndarray:
    """A field over the particles of one settled trial, (P, M), that was found beside `uniform`, as one over another's.

    Each particle there is as many times stiffer than `values` as the nearest here is than `uniform`.
    """
    even = coarse.theta(uniform)
    if trial is coarse and values == uniform:
        return field
    ratio = np.where(even != 0, field / np.where(even != 0, even, 1.0), 1.0)
    near = cKDTree(coarse.bodies[0].body.rest).query(trial.bodies[0].body.rest)[1]
    return trial.theta(values) * ratio[near]


def on_finer_grid(
    fine: Trial, values: Values, coarse: Trial, uniform: Values, field: np.ndarray, history: list
) -> tuple[Trial, np.ndarray, Run] | None:
    """A settled trial on a finer grid, held as the coarse one is, with that one's field, (P, M), and the run of it.

    None, with a line in `history`, where it does not bear that: held softer it would follow the grip less.
    """
    edge_kept = {"rim": coarse.motion.rim, "rim_radius": coarse.motion.rim_radius}
    fine = replace(fine, grip=coarse.grip, motion=replace(fine.motion, **edge_kept))
    theta = brought(field, coarse, uniform, fine, values)
    try:
        return fine, theta, with_margin(fine, values, theta)
    except Breakdown as breakdown:
        history.append({"round": "finer grid", "cost": None, "broke": str(breakdown)})
        return None
