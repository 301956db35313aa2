"""Laws fitted with everything about them free: how strong, where, how wide, when, how fast, along which direction.

What the search found is the start. The engine itself runs at every trial (Levenberg-Marquardt; forward differences at
first, then Broyden's secants), so that what the tangent cannot show, a lump so stiff that it moves as one, counts. The
base's E, nu and eta are free in the same runs, because a base fitted without the law has made up for it; the other
nuisances stay free through the metric. Each number has a prior around its start, as wide as the search was coarse.

Broyden, A class of methods for solving nonlinear simultaneous equations, Mathematics of Computation 19 (1965).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from surgisim.diagnosis import calibration
from surgisim.diagnosis.base import SPREAD, START, bounded
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import APART, scale
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.laws import IMPOSSIBLE, Law, beside, joined, law_of, respond
from surgisim.diagnosis.metric import metric
from surgisim.estimation.trial import at_once

LOGARITHMS = {
    "tau": 0.7, "yield_strain": 0.4, "onset": 0.4, "k2": 0.6, "rate": 0.15, "most": 0.5, "period": 0.15,
    "wavelength": 0.4,
}  # fmt: skip
"""Numbers of a form that are searched by their logarithm, and how far they may be off."""
EXTENT, MOMENT, TURN, PHASE, GROWS, SLACK = 0.5, 0.12, 0.25, 0.7, 0.7, 5e-4
"""How far an extent (logarithm), a moment [s], a direction [rad], a phase [rad], the exponent of a tension [1] and a
slack [m] may be off."""
STEP = 0.3
"""Of the forward differences, in prior standard deviations."""
ROUNDS, FRESH = 8, 2
"""Steps at most, and how often the differences are taken afresh."""
DONE, LITTLE, FAR = 0.004, 3.0, 0.15
"""Share of the whole gain, and chi square, below which a step is the last; share beyond which the next one takes
differences afresh."""
DRAWS = 200
"""From the posterior, which intervals are read off."""


Start = tuple[Hypothesis, np.ndarray]
"""A hypothesis and its amplitude, (H,)."""


@dataclass(frozen=True)
class Refined:
    laws: list[Start]
    draws: list[list[Start]]
    """The same laws, drawn from their posterior: a list for each."""
    x: np.ndarray
    """The base that goes with it, (3,)."""
    response: np.ndarray
    """What the laws and their own base add to the base over the whole clip [m], (K, T, 3)."""
    gain: float
    """Of twice the log posterior over nothing."""


def refined(
    case, z: np.ndarray, starts: Sequence[Start], response: np.ndarray, say: Callable[[str], None],
    base_at: np.ndarray | None = None,
) -> Refined | None:  # fmt: skip
    """The best laws near `starts`, whose response together [m], (K, T, 3), is known.

    case: a `diagnose.Case`; z: whitened residual of the base, (N,); base_at: a base to begin with as well, (3,). None
    where the engine breaks down at the start.
    """
    clip, base, whiten, until = case.clip, case.base, case.whiten, case.clip.until
    knobs = [_knobs(h, amplitude, clip) for h, amplitude in starts]
    own = sum(len(k) for k in knobs)
    name = " and ".join(h.term for h, _ in starts)
    # The base is searched by the engine: its slopes leave the metric.
    space = metric(np.delete(case.space.columns, case.slopes, axis=1))

    def turned(x: np.ndarray) -> tuple[list[Start], np.ndarray]:
        there, at, found = bounded(base.x + x[own:] * SPREAD, clip), 0, []
        for (h, amplitude), mine in zip(starts, knobs, strict=True):
            here = _turned(h, amplitude, mine, x[at : at + len(mine)], clip)
            # Only what pushes or resists over the tissue's own stiffness shows.
            found.append(beside(*here, float(np.exp(there[0] - base.x[0]))))
            at += len(mine)
        return found, there

    def law_at(x: np.ndarray) -> tuple[Law, np.ndarray]:
        laws, there = turned(x)
        return joined([law_of(h, amplitude, clip) for h, amplitude in laws]), there

    def left(x: np.ndarray, _worker: int = 0) -> np.ndarray | None:
        try:
            law, there = law_at(x)
            moved = respond(clip, replace(base, x=there), law, case.memo, until)
        except IMPOSSIBLE:
            return None
        return z - whiten(moved - base.simulated[:, :until])

    def cost(x: np.ndarray, r: np.ndarray | None) -> float:
        return np.inf if r is None else float(space.gram(r[:, None], r[:, None])[0, 0] + x @ x)

    likely = case.space.likely(z - whiten(response[:, :until]))[case.slopes]
    usual = (np.array([START[0], base.x[1], START[2]]) - base.x) / SPREAD
    bases = [0 * usual, np.clip(likely, -2, 2), usual]
    if base_at is not None:
        bases.append((base_at - base.x) / SPREAD)
    begins = [np.concatenate([np.zeros(own), by]) for by in bases]
    say(f"{name} with all numbers free")
    residuals = at_once(left, begins, case.workers)
    k = int(np.argmin([cost(x, r) for x, r in zip(begins, residuals, strict=True)]))
    x, r = begins[k], residuals[k]
    if r is None:
        return None
    nothing, best, damping = float(case.space.gram(z[:, None], z[:, None])[0, 0]), cost(x, r), 0.1
    J, fresh, normal = None, 0, np.eye(len(x))
    for n in range(ROUNDS):
        say(f"{name} with all numbers free, round {n + 1} of at most {ROUNDS}")
        if J is None:
            sides = at_once(left, [x + STEP * e for e in np.eye(len(x))], case.workers)
            J = np.stack([np.zeros_like(r) if s is None else (r - s) / STEP for s in sides], 1)
            fresh += 1
        normal = space.gram(J, J) + np.eye(len(x))
        pull = space.gram(J, r[:, None])[:, 0] - x
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
    # As uncertain as the verdict takes evidence to be: signatures are not exact.
    heat = calibration.TEMPERATURE + calibration.MISFIT * max(nothing - best, 0.0)
    spread = np.linalg.inv((normal - np.eye(len(x))) / heat + np.eye(len(x)))
    rng = np.random.default_rng([case.settings.seed, 3])
    draws = [turned(near)[0] for near in rng.multivariate_normal(x, spread, DRAWS)]
    return Refined(turned(x)[0], [list(d) for d in zip(*draws, strict=True)], there, response, nothing - best)


def _knobs(h: Hypothesis, amplitude: np.ndarray, clip: Clip) -> list[tuple[str, object, float]]:
    """What may be turned: kind, which, and its prior standard deviation."""
    size = float(np.linalg.norm(amplitude)) or 1.0
    if (h.sign and len(amplitude) == 1) or h.term == "respiration":
        # A base's motion enters linearly: its direction and course stay as the search found them.
        knobs = [("strength", 0, 1.0)]
    else:
        knobs = [("amplitude", k, size) for k in range(len(amplitude))]
    if h.place is not None and h.term != "tool_slip":
        if h.place.normal is None:
            knobs += [("center", e, 0.5 * APART * scale(clip)) for e in range(3)]
            knobs.append(("extent", None, EXTENT))
        else:
            knobs.append(("depth", None, 0.5 * APART * scale(clip)))
    moving = h.term in ("hidden_contact", "added_mass", "gravity", "tool_slip", "active_contraction")
    names = ("onset",) if h.term == "tool_slip" else ("onset", "end")
    knobs += [(name, None, MOMENT) for name in names if moving and getattr(h, name) is not None]
    # Damage has a rate of one, which its amplitude scales.
    free = {k: sd for k, sd in LOGARITHMS.items() if (h.term, k) != ("damage", "rate")}
    knobs += [("logarithm", key, sd) for key, sd in free.items() if h.about.get(key, 0) > 0]
    if "axis" in h.about:
        knobs.append(("turn", "axis", TURN))
    if "phase" in h.about:
        knobs.append(("plus", "phase", PHASE))
    if "grows" in h.about:
        knobs.append(("grows", "grows", GROWS))
    if "slack" in h.about:
        knobs.append(("slack", "slack", SLACK))
    return knobs


def _turned(h: Hypothesis, amplitude: np.ndarray, knobs, x: np.ndarray, clip: Clip) -> tuple[Hypothesis, np.ndarray]:
    """The hypothesis and its amplitude with every knob turned by x standard deviations."""
    amplitude, about, place = amplitude.astype(float).copy(), dict(h.about), h.place
    moments = {"onset": h.onset, "end": h.end}
    for (kind, which, _), by in zip(knobs, x * np.array([k[2] for k in knobs]), strict=True):
        if kind == "strength":
            amplitude *= np.exp(by)
        elif kind == "amplitude":
            amplitude[which] += by
        elif kind == "center":
            place = replace(place, center=tuple(np.asarray(place.center) + by * np.eye(3)[which]))
        elif kind == "depth":
            place = replace(place, center=tuple(np.asarray(place.center) + by * clip.normal))
        elif kind == "extent":
            place = replace(place, extent=place.extent * float(np.exp(by)))
        elif kind in moments:
            moments[kind] = max(moments[kind] + by, 0.0)
        elif kind == "logarithm":
            about[which] *= float(np.exp(by))
            if which == "most":
                about[which] = min(about[which], 1.0)
        elif kind == "turn":
            axis, n = np.asarray(about[which]), clip.normal
            about[which] = np.cos(by) * axis + np.sin(by) * np.cross(n, axis)
        elif kind == "plus":
            about[which] += by
        elif kind == "grows":
            about[which] = float(np.clip(about[which] + by, -1.0, 1.0))
        elif kind == "slack":
            about[which] = max(about[which] + by, 0.0)
    return replace(h, place=place, about=about, **moments), amplitude
