"""Whether the simulated tissue goes where the recorded tissue went."""

from typing import Any

import numpy as np

from surgisim.artifacts.frames import AFTER, USED
from surgisim.measure.compared import OF_MOVING, compared
from surgisim.measure.distance import distance, distance_over_time
from surgisim.measure.groups.masking import NO_TRUTH
from surgisim.measure.groups.pictures import parts_of, pictures, table
from surgisim.measure.groups.replay_pictures import by_grip, replay_pictures
from surgisim.measure.lpips import Lpips
from surgisim.measure.number import number
from surgisim.measure.reference import Reference, tracked, true
from surgisim.measure.run import Run

STATED = {
    "default": "frames never fitted, with default parameters",
    "fitted": "frames never fitted",
    "after_release_default": "frames never fitted after the release, with default parameters",
    "after_release_fitted": "frames never fitted after the release",
    "used_default": "fitted frames, with default parameters",
    "used_fitted": "fitted frames",
}
"""Errors that estimation measured itself, and on which frames."""


def simulation(run: Run, lpips: Lpips | None) -> dict[str, dict[str, Any]]:
    if len(run.replay.time) != run.camera.frames:
        why_not = (
            f"the replay has {len(run.replay.time)} frames, the recording {run.camera.frames}: another manipulation"
        )
        return _stated(run) | {"tracked_held_out": number(None, run.length_unit, "", why_not=why_not)}
    numbers = _compared(run, tracked(run)) | _true(run) | _stated(run)
    if len(run.replay.rgb) == len(run.frames.rgb):
        drawn = pictures(run.replay.rgb, run, lpips)
        numbers |= table(drawn, parts_of(run.frames.split) | by_grip(run)) | replay_pictures(run)
    else:
        numbers["psnr_between"] = number(None, "dB", "", why_not="the replay was not rendered frame by frame")
    return numbers


def _true(run: Run) -> dict[str, dict[str, Any]]:
    to = true(run)
    return _compared(run, to) if to else {"true_held_out": number(None, "mm", "", why_not=NO_TRUTH)}


def _compared(run: Run, to: Reference) -> dict[str, dict[str, Any]]:
    """Displacements of the replay against the reference's, by part of the recording."""
    by = compared(run, to)
    moved, moved_px, wanted, wanted_px = by.ours, by.ours_px, by.wanted, by.wanted_px
    on_body, counted, lively = by.on_body, by.counted, by.lively
    still, still_px = np.zeros_like(wanted), np.zeros_like(wanted_px)
    over_time = {
        suffix: distance_over_time(guess, wanted_px, counted & lively, "mean")
        for suffix, guess in {"_moving_px": moved_px, "_moving_still_px": still_px}.items()
    }
    share = on_body.mean() if len(on_body) else None
    numbers = {f"{to.name}_on_body": number(share, "1", f"share within the body: {to.what}")}
    split = run.frames.split
    for part, (where, words) in {
        "used": (split == USED, "frames used in the fit"),
        "held_out": (split != USED, "frames never used in the fit"),
        "after": (split == AFTER, "frames after the last used one"),
        "released": (to.phase == "released", "frames after the grip lets go"),
    }.items():
        here = counted & where
        how = f"{words}, {to.what}; frame 0 left out"
        of_moving = f"mean over {OF_MOVING}, {how}"
        entries = {
            "": (1e3 * distance(moved, wanted, here).median, to.unit, f"median over {how}"),
            "_px": (distance(moved_px, wanted_px, here).median, "px", f"median in the picture over {how}"),
            "_moving": (1e3 * distance(moved, wanted, here & lively).mean, to.unit, of_moving),
            "_moving_px": (distance(moved_px, wanted_px, here & lively).mean, "px", f"in the picture, {of_moving}"),
            "_moving_still": (
                1e3 * distance(still, wanted, here & lively).mean,
                to.unit,
                f"if nothing moved: {of_moving}",
            ),
            "_moving_still_px": (
                distance(still_px, wanted_px, here & lively).mean,
                "px",
                f"in the picture, if nothing moved: {of_moving}",
            ),
        }
        for suffix, (value, unit, protocol) in entries.items():
            numbers[f"{to.name}_{part}{suffix}"] = number(
                value,
                unit,
                protocol,
                series=over_time.get(suffix) if part == "held_out" else None,
                why_not=f"there are no points in {words}",
            )
    return numbers


def _stated(run: Run) -> dict[str, dict[str, Any]]:
    """What estimation itself measured on frames it never fitted."""
    said = "stated by estimation: mean distance of moving tracked points, across the view where depth is a guess, on "
    return {
        f"fit_{name}": number(None if value is None else 1e3 * value, run.length_unit, said + where)
        for name, where in STATED.items()
        for value in [run.fit.held_out.get(name)]
    }
