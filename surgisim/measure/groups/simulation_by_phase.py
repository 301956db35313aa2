"""Errors of the replay on frames never fitted, phase by phase, beside a still body's and a rigid one's."""

from typing import Any

import numpy as np

from surgisim.artifacts.frames import USED
from surgisim.measure.compared import OF_MOVING, Compared, compared, from_start, moving
from surgisim.measure.number import number, ranged
from surgisim.measure.reference import Reference, tracked, true
from surgisim.measure.resample import Estimate, ratio
from surgisim.measure.run import Run
from surgisim.measure.spans import SPANS, within

GUESSES = {
    "": "the replay",
    "_still": "if nothing moved",
    "_rigid": "if all of them went as the nearest grip does that holds, back in place without one",
}
"""Suffix -> what is said to happen to the points."""


def simulation_by_phase(run: Run) -> dict[str, dict[str, Any]]:
    """Nothing where the replay is of another manipulation or nothing is gripped, which `simulation` and `grasp` say."""
    if len(run.replay.time) != run.camera.frames:
        return {}
    references = [r for r in (tracked(run), true(run)) if r is not None]
    return {n: e for to in references for n, e in _held_out(run, to).items()} | _stated(run)


def _held_out(run: Run, to: Reference) -> dict[str, dict[str, Any]]:
    by = compared(run, to)
    numbers = {f"{to.name}_moving_on_body": _covered(by, to)}
    held_out = run.frames.split != USED
    views = [("_px", _apart(by.wanted_px, by.ours_px, by.rigid_px), "px", 1.0)]
    if to.name == "true" or run.depth.follows:
        views.insert(0, ("", _apart(by.wanted, by.ours, by.rigid), to.unit, 1e3))
    else:
        why_not = "the way of tracks along the view is a guess from brightness, so none is known in space"
        numbers[f"{to.name}_held_out_pull_moving"] = number(None, to.unit, "", why_not=why_not)
    for span, (_, words) in SPANS.items():
        here = by.counted & by.lively & held_out & within(to.phase, span)
        how = f"of {OF_MOVING}, frames never used in the fit {words}, {to.what}"
        for view, apart, unit, factor in views:
            summed = {name: np.where(here, each, 0).sum(1) for name, each in apart.items()}
            start, seen = f"{to.name}_held_out_{span}_moving", here.sum(1)
            why_not = f"no moving point is seen in a frame never used {words}"
            for guess, what in GUESSES.items():
                numbers[f"{start}{guess}{view}"] = ranged(
                    ratio(summed[guess], seen), unit, f"mean distance, {what}, {how}", factor=factor, why_not=why_not
                )
            for other in ("_still", "_rigid"):
                numbers[f"{start}_of{other}{view}"] = ranged(
                    ratio(summed[""], summed[other]), "%",
                    f"the replay's mean distance as a share of that {GUESSES[other]}, {how}", factor=100,
                    why_not=why_not,
                )  # fmt: skip
    return numbers


def _apart(wanted: np.ndarray, ours: np.ndarray, rigid: np.ndarray) -> dict[str, np.ndarray]:
    """Distances (K, T) by guess."""
    guesses = {"": ours, "_still": np.zeros_like(wanted), "_rigid": rigid}
    return {name: np.linalg.norm(guess - wanted, axis=-1) for name, guess in guesses.items()}


def _covered(by: Compared, to: Reference) -> dict[str, Any]:
    """Points that the body has not are in no error, so how many of those that matter it has."""
    seen = to.visible & np.isfinite(by.wanted).all(-1)
    lively = moving(from_start(to.way), seen, seen.any(1))[:, 0]
    share = by.on_body[lively].mean() if lively.any() else None
    return number(share, "1", f"share within the body of {OF_MOVING}: {to.what}", why_not="no point moves")


def _stated(run: Run) -> dict[str, dict[str, Any]]:
    """What estimation measured itself, in its own protocol, with default parameters and with the fitted ones."""
    said = "stated by estimation: mean distance of moving tracked points, across the view where depth is a guess, on "
    numbers = {}
    for span, found in run.fit.held_out.get("by_phase", {}).items():
        where = f"frames never fitted {SPANS[span][1]}"
        for name, words in (("default", ", with default parameters"), ("fitted", "")):
            if found.get(name):
                numbers[f"fit_{span}_{name}"] = ranged(
                    Estimate(**found[name]), run.length_unit, said + where + words, factor=1e3
                )
        if found.get("share"):
            numbers[f"fit_{span}_share"] = ranged(
                Estimate(**found["share"]), "%", f"{said}{where}: fitted as a share of default", factor=100
            )
    return numbers
