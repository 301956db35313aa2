"""Laws fitted with everything about them free: how strong, where, how wide, when, how fast, along which direction.

What the search found is the start. The engine itself runs at every trial (Levenberg-Marquardt; forward differences at
first, then Broyden's secants), so that what the tangent cannot show, a lump so stiff that it moves as one, counts. The
base's E, nu and eta, and the moments of release, are free in the same runs, because a base fitted without the law has
made up for it; the other nuisances stay free through the metric. Each number of a law has a prior around its start, as
wide as the search was coarse.

Broyden, A class of methods for solving nonlinear simultaneous equations, Mathematics of Computation 19 (1965).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from surgisim.diagnosis import calibration, candidates
from surgisim.diagnosis.base import Known, bounded, softness
from surgisim.diagnosis.clip import OPENS
from surgisim.diagnosis.knobs import Start, turned
from surgisim.diagnosis.laws import IMPOSSIBLE, Law, beside, joined, law_of, respond
from surgisim.diagnosis.ring_down import DRAWS, EARLIEST, LATE, LATEST, Descent, aside
from surgisim.estimation.trial import at_once

STEP = 0.3
"""Of the forward differences, in prior standard deviations."""
ROUNDS, FRESH = 8, 2
"""Steps at most, and how often the differences are taken afresh."""
DONE, LITTLE, FAR = 0.004, 3.0, 0.15
"""Share of the whole gain, and chi square, below which a step is the last; share beyond which the next one takes
differences afresh."""


@dataclass(frozen=True)
class Refined:
    laws: list[Start]
    draws: list[list[Start]]
    """The same laws, drawn from their posterior: a list for each."""
    x: np.ndarray
    """The base that goes with it and its moments of release, (3 + R,)."""
    known: Known
    """How surely."""
    response: np.ndarray
    """What the laws and their own base add to the base over the whole clip [m], (K, T, 3)."""
    gain: float
    """Of twice the log posterior over nothing."""


def refined(
    case, z: np.ndarray, starts: Sequence[Start], response: np.ndarray, say: Callable[[str], None],
    bases_at: Sequence[np.ndarray] = (), begun: Sequence[Descent] = (),
) -> Refined | None:  # fmt: skip
    """The best laws near `starts`, whose response together [m], (K, T, 3), is known.

    case: a `diagnose.Case`; z: whitened residual of the base, (N,); bases_at:
    bases to begin with as well, (3 + R,) each; begun: where bases got to beside that response.
    None where the engine breaks down at the start.
    """
    clip, base, whiten, until = case.clip, case.base, case.whiten, case.clip.until
    knobs = [candidates.of(h).knobs(h, amplitude) for h, amplitude in starts]
    own = sum(len(k) for k in knobs)
    name = " and ".join(h.term for h, _ in starts)
    space = case.beside_base
    shown = clip.releases() if "release" not in case.settings.without else []
    late = np.array([clip.opening[j, t] for j, t in shown])
    middle, spread = clip.prior.middle, clip.prior.spread
    start, reach = np.concatenate([base.x, late]), np.concatenate([spread, np.full(len(late), LATE)])

    def base_of(x: np.ndarray) -> np.ndarray:
        there = start + x[own:] * reach
        return np.concatenate([bounded(there[:3], clip), np.clip(there[3:], EARLIEST, LATEST)])

    def all_turned(x: np.ndarray) -> tuple[list[Start], np.ndarray]:
        there, at, found = base_of(x), 0, []
        for (h, amplitude), mine in zip(starts, knobs, strict=True):
            here = turned(h, amplitude, mine, x[at : at + len(mine)], clip)
            # Only what pushes or resists over the tissue's own stiffness shows.
            found.append(beside(*here, float(np.exp(there[0] - base.x[0]))))
            at += len(mine)
        return found, there

    def law_at(x: np.ndarray) -> tuple[Law, np.ndarray]:
        laws, there = all_turned(x)
        return joined([law_of(h, amplitude, clip) for h, amplitude in laws]), there

    def left(x: np.ndarray, _worker: int = 0) -> np.ndarray | None:
        try:
            law, there = law_at(x)
            moved = respond(clip, replace(base, x=there), law, case.memo, until)
        except IMPOSSIBLE:
            return None
        return z - whiten(moved - base.simulated[:, :until])

    def cost(x: np.ndarray, r: np.ndarray | None) -> float:
        return np.inf if r is None else float(space.gram(r[:, None], r[:, None])[0, 0] + ((x - prior) ** 2).sum())

    likely = case.space.likely(z - whiten(response[:, :until]))[case.slopes]
    likely = np.concatenate([np.clip(likely, -2, 2), 0 * late])
    usual = (np.concatenate([[middle[0], base.x[1], middle[2]], 0 * late + OPENS]) - start) / reach
    # Each law's numbers have a prior around where they begin, the base's around what tissue is.
    prior = np.concatenate([np.zeros(own), (np.concatenate([middle, 0 * late + OPENS]) - start) / reach])
    bases = [0 * usual, likely, usual, *((at - start) / reach for at in bases_at)]
    begins = [np.concatenate([np.zeros(own), by]) for by in bases]
    say(f"{name} with all numbers free")
    residuals = at_once(left, begins, case.workers)
    k = int(np.argmin([cost(x, r) for x, r in zip(begins, residuals, strict=True)]))
    x, r = begins[k], residuals[k]
    if r is None:
        return None
    nothing = float(case.space.gram(z[:, None], z[:, None])[0, 0] + prior @ prior)
    best, damping = cost(x, r), 0.1
    J, fresh, normal = None, 0, np.eye(len(x))
    for n in range(ROUNDS):
        say(f"{name} with all numbers free, round {n + 1} of at most {ROUNDS}")
        if J is None:
            sides = at_once(left, [x + STEP * e for e in np.eye(len(x))], case.workers)
            J = np.stack([np.zeros_like(r) if s is None else (r - s) / STEP for s in sides], 1)
            fresh += 1
        normal = space.gram(J, J) + np.eye(len(x))
        pull = space.gram(J, r[:, None])[:, 0] - (x - prior)
        steps = [
            np.clip(np.linalg.solve(normal + f * damping * np.diag(np.diag(normal)), pull), -1.5, 1.5)
            for f in (0.1, 3.0)
        ]
        results = at_once(left, [x + s for s in steps], case.workers)
        for step, result in zip(steps, results, strict=True):
            if result is not None:
                J = J + np.outer((r - result) - J @ step, step) / max(step @ step, 1e-12)
        costs = [cost(x + s, result) for s, result in zip(steps, results, strict=True)]
        k = int(np.argmin(costs))
        won = (best - costs[k]) / max(nothing - min(costs[k], best), 1.0)
        if costs[k] < best:
            x, r, best, damping = x + steps[k], results[k], costs[k], damping * (0.1, 3.0)[k]
        else:
            damping *= 10
        if won < max(DONE, LITTLE / max(nothing - best, 1.0)) and (won > 0 or n > 0):
            break
        if won > FAR and fresh < FRESH:
            J = None
    law, there = law_at(x)
    try:
        response = respond(clip, replace(base, x=there), law, case.memo) - base.simulated
    except IMPOSSIBLE:
        return None
    heat = calibration.temperature(calibration.ALIKE_ERRORS, nothing - best)
    near_by = np.linalg.inv((normal - np.eye(len(x))) / heat + np.eye(len(x)))
    rng = np.random.default_rng([case.settings.seed, 3])
    near = rng.multivariate_normal(x, near_by, DRAWS)
    others = aside(begun, heat) if begun else np.zeros((DRAWS, 3))
    near[:, own : own + 3] += others / spread
    laws = [list(d) for d in zip(*(all_turned(one)[0] for one in near), strict=True)]
    known = Known(near_by[own : own + 3, own : own + 3] * np.outer(spread, spread) + softness(clip), others)
    return Refined(all_turned(x)[0], laws, there, known, response, nothing - best)
