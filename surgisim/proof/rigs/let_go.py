"""What a body lacks that is let go and swings: each law in the engine itself, fitted, and tried on another take.

The diagnosis of pulled tissue answers forces by a tangent stiffness, which a body that swings does not obey. Here
nothing is linearised: every candidate is run, its numbers scanned and then fitted to one take, and what is
named is the law under which another take, never fitted, is predicted best. A law within CLOSE of the best there cannot
be told from it.
"""

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from surgisim.artifacts.verdict import Candidate, Effect, Verdict
from surgisim.mpm.setup import Values, prepare
from surgisim.mpm.simulator import Breakdown
from surgisim.physics.catalogue import choose
from surgisim.physics.place import Place
from surgisim.proof.known.catalogue import Found, Panel, curve
from surgisim.recordings.recording import Recording

CLOSE = 1.10
EVALUATIONS = 5
FLOOR = 1e-4
"""Swing below which markers are as good as still [m]."""
DIFFERENCE = 0.03
"""Relative step of the differences that a fit goes by."""

Draw = Callable[[Recording, np.ndarray, np.ndarray], Panel]
Make = Callable[[np.ndarray], tuple[Values, dict[str, Place]]]


@dataclass(frozen=True)
class Law:
    """A way in which the base may be wrong."""

    name: str
    make: Make
    """Its values and places from its numbers."""
    scan: tuple[tuple[float, ...], ...]
    """For each number the values that are tried before the fit, all combinations of them."""
    low: tuple[float, ...] = ()
    high: tuple[float, ...] = ()


@dataclass(frozen=True)
class Tried:
    law: Law
    x: np.ndarray
    fitted: float
    """RMS distance on the take that is fitted [m]."""
    other: float
    """The same on the other take."""


def simulate(take: Recording, values: Values, places: Mapping[str, Place], spacing: float, frames: int) -> np.ndarray:
    """Displacement of the take's points [m], (K, frames, 3), let go at rest. Raises Breakdown."""
    prepared = prepare(
        take.body(spacing),
        tuple(values),
        density=take.density,
        gravity=take.gravity,
        carried=take.attached(),
        places=places,
    )
    theta = prepared.theta(values)
    per_frame = prepared.per_frame_of(prepared.stiffest(theta), take.fps)
    drive = prepared.drive(take.motion, values, fps=take.fps, per_frame=per_frame, frames=frames)
    run = prepared.simulator.run(theta, drive)
    carry = prepared.simulator.carry(take.attached())
    return np.stack([carry @ u for u in run.u.astype(float)], 1)


def misfit(take: Recording, moved: np.ndarray) -> np.ndarray:
    """Recorded minus simulated [m], (K, T, 3), NaN where unseen and nowhere else. Raises Breakdown."""
    if not np.isfinite(moved).all():
        raise Breakdown("a body let go has points that are nowhere. Take a smaller step or a softer tissue.")
    seen = take.points[:, : moved.shape[1]].astype(float) - take.attached()[:, None]
    return seen - moved


def rms(left: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean((left**2).sum(-1))))


def alike(take: Recording, frames: int, frequency: float) -> np.ndarray:
    """Weights under which a body's late swings count as much as its first ones, (frames,): one over how far its points
    go within the period around a frame, no less than FLOOR, largest 1."""
    path = take.points[:, :frames].astype(float)
    span = min(round(take.fps / frequency), frames)
    first = np.clip(np.arange(frames) - span // 2, 0, frames - span)
    parts = np.stack([path[:, t : t + span] for t in first])
    swing = np.sqrt(((parts - parts.mean(2, keepdims=True)) ** 2).sum(-1).mean((1, 2)))
    weight = 1 / np.maximum(swing, FLOOR)
    return weight / weight.max()


def try_law(
    law: Law, base: Values, take: Recording, other: Recording, spacing: float, frames: int, weight: np.ndarray,
    evaluations: int,
) -> Tried:  # fmt: skip
    """Scan, fit with frames weighted, (frames,), predict the other take."""

    def left(x: np.ndarray, on: Recording) -> np.ndarray:
        values, places = law.make(x)
        return misfit(on, simulate(on, {**base, **values}, places, spacing, frames))

    seen = np.isfinite(take.points[:, :frames]).all(-1)
    starts = [np.array(x) for x in itertools.product(*law.scan)]
    errors = []
    for x in starts:
        try:
            errors.append(rms(weight[:, None] * left(x, take)))
        except Breakdown:
            errors.append(np.inf)
    x = starts[int(np.argmin(errors))]
    bounds = (np.array(law.low), np.array(law.high)) if law.low else (-np.inf, np.inf)
    found = least_squares(
        lambda x: 1e3 * (weight[:, None] * left(x, take))[seen].ravel(), x, bounds=bounds,
        x_scale=np.maximum(np.abs(x), 1e-6), diff_step=DIFFERENCE, max_nfev=evaluations, xtol=1e-3, ftol=1e-3,
    )  # fmt: skip
    return Tried(law, found.x, rms(left(found.x, take)), rms(left(found.x, other)))


def name(
    laws: list[Law], base: Values, take: Recording, other: Recording, spacing: float, seconds: float, progress,
    swings: float | None = None, other_is: str = "a take that was never fitted",
    evaluations: int = EVALUATIONS, draw: Draw | None = None,
) -> Found:  # fmt: skip
    """The law under which the other take is predicted best, and how much better than by the base.

    other_is: what the other take is, in words. swings: frequency [Hz] of a body all of whose swings shall count alike
    in a fit; otherwise the largest count most. draw: the picture of the other take, from it and its displacement under
    base and named law [m], (K, T, 3); how its liveliest point swings unless said.
    """
    frames = round(seconds * take.fps) + 1
    weight = np.ones(frames) if swings is None else alike(take, frames, swings)
    bare = [simulate(r, base, {}, spacing, frames) for r in (take, other)]
    plain = [rms(misfit(r, moved)) for r, moved in zip((take, other), bare, strict=True)]
    tried = []
    for i, law in enumerate(laws):
        progress(i, len(laws), law.name)
        tried.append(try_law(law, base, take, other, spacing, frames, weight, evaluations))
    tried.sort(key=lambda t: t.other)
    best = tried[0]
    like = [t for t in tried[1:] if t.other < CLOSE * best.other and t.fitted < plain[0]]
    pays = best.other < plain[1] and best.fitted < plain[0]
    verdict = "nothing detectable" if not pays else "equivalence class" if like else "named"
    # Two independent numbers a swing; not calibrated, only a way to say how far the others are behind.
    weight = {t.law.name: (best.other / t.other) ** frames**0.5 for t in tried}
    share = {n: w / sum(weight.values()) for n, w in weight.items()}
    effects = tuple(_effect(t, share) for t in [best, *like]) if pays else ()
    ranking = tuple(Candidate(t.law.name, None, None, share[t.law.name], None, 1e3 * t.other) for t in tried)
    fit = {"before": 1e3 * plain[0], "after": 1e3 * best.fitted, "placebo": 1e3 * tried[-1].fitted}
    held = {"before": 1e3 * plain[1], "after": 1e3 * best.other, "placebo": 1e3 * tried[-1].other}
    said = best.law.name.replace("_", " ")
    words = (
        f"Without {said} the simulation is {1e3 * plain[1]:.2g} mm off {other_is}, with it {1e3 * best.other:.2g} mm."
    )
    behind = [t for t in tried[1:] if t not in like]
    if behind:
        words += f" The next law, {behind[0].law.name.replace('_', ' ')}, leaves {1e3 * behind[0].other:.2g} mm."
    told = Verdict(take.name, verdict, effects, ranking, None, (), fit, held, None, words)
    values, places = best.law.make(best.x) if pays else ({}, {})
    moved = simulate(other, {**base, **values}, places, spacing, frames)
    physics = _physics(base, best if pays else None, spacing, take) | {"tried": [_row(t) for t in tried]}
    return Found(told, physics, ((draw or swing)(other, bare[1], moved),))


def swing(take: Recording, base: np.ndarray, named: np.ndarray) -> Panel:
    """The take's liveliest point over time, along gravity."""
    frames = base.shape[1]
    seen = take.points[:, :frames].astype(float) - take.attached()[:, None]
    down = np.array(take.gravity or (0.0, 0.0, -1.0))
    along = [1e3 * moved @ (down / np.linalg.norm(down)) for moved in (seen, base, named)]
    point = int(np.nanargmax(np.nanstd(along[0], axis=1)))
    time = np.arange(frames) / take.fps
    words = "the liveliest point of a take that was never fitted"
    return Panel(words, "time [s]", "down [mm]", *(curve(time, a[point]) for a in along))


def _effect(tried: Tried, share: dict[str, float]) -> Effect:
    values, places = tried.law.make(tried.x)
    term = tried.law.name
    place = places.get(term)
    units = choose([term])[term].params
    numbers = {k: {"value": float(v), "unit": units[k].unit} for k, v in values[term].items()}
    center = None if place is None else tuple(float(c) for c in place.center)
    return Effect(term, share[term], center, None if place is None else place.extent, parameters=numbers)


def _physics(base: Values, best: Tried | None, spacing: float, take: Recording) -> dict[str, Any]:
    values, places = ({}, {}) if best is None else best.law.make(best.x)
    every = {**base, **values}
    laws = choose(every)
    return {
        "terms": {
            n: {k: {"value": float(v), "unit": laws[n].params[k].unit} for k, v in told.items()}
            for n, told in every.items()
        },
        "places": {
            n: {
                "center": list(map(float, p.center)),
                "extent": p.extent,
                "normal": None if p.normal is None else list(map(float, p.normal)),
            }
            for n, p in places.items()
        },
        "density": take.density,
        "grid": {"spacing": spacing},
    }


def _row(tried: Tried) -> dict[str, Any]:
    return {
        "law": tried.law.name,
        "numbers": tried.x.tolist(),
        "fitted_mm": 1e3 * tried.fitted,
        "other_mm": 1e3 * tried.other,
    }
