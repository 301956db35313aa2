"""A law fitted with everything about it free: how strong, where, how wide, when, how fast, along which direction.

What the search found is the start. The engine itself runs at every trial (Levenberg-Marquardt, forward differences),
so that what the tangent cannot show, a lump so stiff that it moves as one, counts; the base and the nuisances stay free
through the metric. Each number has a prior around its start, as wide as the search was coarse.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from surgisim.diagnosis.base import Base
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import APART, scale
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.laws import law_of, respond
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.metric import Metric
from surgisim.diagnosis.noise import Whitener
from surgisim.estimation.trial import at_once
from surgisim.mpm.simulator import Breakdown
from surgisim.physics.place import Misplaced

LOGARITHMS = {
    "tau": 0.7, "yield_strain": 0.4, "onset": 0.4, "k2": 0.6, "rate": 0.15, "period": 0.15, "wavelength": 0.4,
}  # fmt: skip
"""Numbers of a form that are searched by their logarithm, and how far they may be off."""
EXTENT, MOMENT, TURN, PHASE, SLACK = 0.5, 0.12, 0.25, 0.7, 5e-4
"""How far an extent (logarithm), a moment [s], a direction [rad], a phase [rad] and a slack [m] may be off."""
STEP = 0.3
"""Of the forward differences, in prior standard deviations."""
ROUNDS = 3


@dataclass(frozen=True)
class Refined:
    hypothesis: Hypothesis
    amplitude: np.ndarray
    spread: np.ndarray
    """Posterior standard deviation of the amplitude."""
    response: np.ndarray
    """What the law adds to the base over the whole clip [m], (K, T, 3)."""
    gain: float
    """Of twice the log posterior over nothing."""


def refined(
    clip: Clip, base: Base, whiten: Whitener, space: Metric, memo: Memo, z: np.ndarray,
    start: tuple[Hypothesis, np.ndarray], say: Callable[[str], None],
) -> Refined | None:  # fmt: skip
    """The best law near `start`, a hypothesis and its amplitude (H,); z: whitened residual of the base, (N,).

    None where the engine breaks down at the start itself.
    """
    h, amplitude = start
    knobs = _knobs(h, amplitude, clip)
    until = clip.until

    def change(x: np.ndarray) -> np.ndarray | None:
        try:
            law = law_of(*_turned(h, amplitude, knobs, x, clip), clip)
            return respond(clip, base, law, memo, until) - base.simulated[:, :until]
        except (Breakdown, Misplaced):
            # A place outside the body, or tissue torn apart: not a law of this clip.
            return None

    def left(x: np.ndarray, _worker: int = 0) -> np.ndarray | None:
        moved = change(x)
        return None if moved is None else z - whiten(moved)

    def cost(x: np.ndarray, r: np.ndarray | None) -> float:
        return np.inf if r is None else float(space.gram(r[:, None], r[:, None])[0, 0] + x @ x)

    x = np.zeros(len(knobs))
    r = left(x)
    if r is None:
        return None
    nothing, best, damping = cost(0 * x, z), cost(x, r), 0.1
    normal = np.eye(len(x))
    for n in range(ROUNDS):
        say(f"{h.term} with all its numbers free, round {n + 1} of {ROUNDS}")
        sides = at_once(left, [x + STEP * e for e in np.eye(len(x))])
        J = np.stack([np.zeros_like(r) if s is None else (r - s) / STEP for s in sides], 1)
        normal = space.gram(J, J) + np.eye(len(x))
        pull = space.gram(J, r[:, None])[:, 0] - x
        trials = [
            x + np.clip(np.linalg.solve(normal + f * damping * np.diag(np.diag(normal)), pull), -1.5, 1.5)
            for f in (0.1, 3.0)
        ]
        results = at_once(left, trials)
        costs = [cost(t, s) for t, s in zip(trials, results, strict=True)]
        k = int(np.argmin(costs))
        if costs[k] >= best:
            damping *= 10
            continue
        done = best - costs[k] < 0.02 * max(nothing - costs[k], 1.0)
        x, r, best, damping = trials[k], results[k], costs[k], damping * (0.1, 3.0)[k]
        if done:
            break
    turned, strength = _turned(h, amplitude, knobs, x, clip)
    try:
        response = respond(clip, base, law_of(turned, strength, clip), memo) - base.simulated
    except Breakdown:
        return None
    sd = np.sqrt(np.diag(np.linalg.inv(normal)))
    off = [_turned(h, amplitude, knobs, x + side, clip)[1] - strength for side in np.diag(sd)]
    return Refined(turned, strength, np.sqrt(np.sum(np.square(off), 0)), response, nothing - best)


def _knobs(h: Hypothesis, amplitude: np.ndarray, clip: Clip) -> list[tuple[str, object, float]]:
    """What may be turned: kind, which, and its prior standard deviation."""
    size = float(np.linalg.norm(amplitude)) or 1.0
    if h.sign and len(amplitude) == 1:
        knobs = [("strength", 0, 1.0)]
    else:
        knobs = [("amplitude", k, size) for k in range(len(amplitude))]
    if h.place is not None and h.term != "tool_slip":
        if h.place.normal is None:
            knobs += [("center", e, 0.5 * APART * scale(clip)) for e in range(3)]
            knobs.append(("extent", None, EXTENT))
        else:
            knobs.append(("depth", None, 0.5 * APART * scale(clip)))
    moving = h.term in ("hidden_contact", "added_mass", "gravity", "tool_slip")
    names = ("onset",) if h.term == "tool_slip" else ("onset", "end")
    knobs += [(name, None, MOMENT) for name in names if moving and getattr(h, name) is not None]
    # Damage has a rate of one, which its amplitude scales.
    free = {k: sd for k, sd in LOGARITHMS.items() if (h.term, k) != ("damage", "rate")}
    knobs += [("logarithm", key, sd) for key, sd in free.items() if h.about.get(key, 0) > 0]
    if "axis" in h.about:
        knobs.append(("turn", "axis", TURN))
    if "phase" in h.about:
        knobs.append(("plus", "phase", PHASE))
    if "slack" in h.about:
        knobs.append(("slack", "slack", SLACK))
    return knobs


def _turned(h: Hypothesis, amplitude: np.ndarray, knobs, x: np.ndarray, clip: Clip) -> tuple[Hypothesis, np.ndarray]:
    """The hypothesis and its amplitude with every knob turned by x standard deviations."""
    amplitude, about, place = amplitude.astype(float).copy(), dict(h.about), h.place
    moments = {"onset": h.onset, "end": h.end}
    for (kind, which, _), by in zip(knobs, x * np.array([k[2] for k in knobs]), strict=True):
        if kind == "strength":
            amplitude[0] *= np.exp(by)
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
        elif kind == "turn":
            axis, n = np.asarray(about[which]), clip.normal
            about[which] = np.cos(by) * axis + np.sin(by) * np.cross(n, axis)
        elif kind == "plus":
            about[which] += by
        elif kind == "slack":
            about[which] = max(about[which] + by, 0.0)
    return replace(h, place=place, about=about, **moments), amplitude
