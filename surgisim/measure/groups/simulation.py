"""Whether the simulated tissue goes where the recorded tissue went."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from surgisim.artifacts.frames import AFTER, USED
from surgisim.measure.carried import carried
from surgisim.measure.distance import distance, distance_over_time
from surgisim.measure.groups.depth import scale_to_truth
from surgisim.measure.groups.masking import NO_TRUTH
from surgisim.measure.groups.pictures import WHEN, pictures
from surgisim.measure.groups.reconstruction import table
from surgisim.measure.groups.replay_pictures import replay_pictures
from surgisim.measure.lpips import Lpips
from surgisim.measure.number import number
from surgisim.measure.phases import phases
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
MOVING = 0.25
"""A point counts as moving if it ever goes this share of the liveliest points' way (95th percentile)."""


def simulation(run: Run, lpips: Lpips | None) -> dict[str, dict[str, Any]]:
    if len(run.replay.time) != run.camera.frames:
        why_not = (
            f"the replay has {len(run.replay.time)} frames, the recording {run.camera.frames}: another manipulation"
        )
        return _stated(run) | {"tracked_held_out": number(None, run.length_unit, "", why_not=why_not)}
    numbers = _tracked(run) | _true(run) | _stated(run)
    if len(run.replay.rgb) == len(run.frames.rgb):
        numbers |= table(pictures(run.replay.rgb, run, lpips), run, WHEN) | replay_pictures(run)
    else:
        numbers["psnr_between"] = number(None, "dB", "", why_not="the replay was not rendered frame by frame")
    return numbers


@dataclass(frozen=True)
class Reference:
    """Where points went, to compare a replay with."""

    name: str
    what: str
    rest: np.ndarray
    """Where the run's own body has them in frame 0 [m], (K, 3); NaN where it has not."""
    xyz: np.ndarray
    """[m], (K, T, 3)."""
    xy: np.ndarray
    """[px], (K, T, 2)."""
    visible: np.ndarray
    """(K, T) bool."""
    phase: np.ndarray
    """(T,) str."""
    unit: str
    scale: float = 1.0
    """Factor from the run's lengths to the reference's [1]."""


def _tracked(run: Run) -> dict[str, dict[str, Any]]:
    tracks = run.tracks
    rest = np.where(tracks.visible[:, :1], tracks.xyz[:, 0], np.nan)
    what = "visible tracks (themselves estimated), each carried by the replay from its place in frame 0"
    phase = phases(run.motion)
    return _compared(
        run, Reference("tracked", what, rest, tracks.xyz, tracks.xy, tracks.visible, phase, run.length_unit)
    )


def _true(run: Run) -> dict[str, dict[str, Any]]:
    truth = run.truth
    if truth is None:
        return {"true_held_out": number(None, "mm", "", why_not=NO_TRUTH)}
    pixel = truth.xy[:, 0]
    column = np.clip(np.rint(pixel[:, 0]).astype(int), 0, run.camera.width - 1)
    row = np.clip(np.rint(pixel[:, 1]).astype(int), 0, run.camera.height - 1)
    rest = run.camera.lift(pixel, run.depth.z[0, row, column])
    scale = scale_to_truth(run)
    what = (
        "true points visible in that frame, lifted from their pixel in frame 0 with the run's depth and carried by "
        f"the replay; displacements in space times {scale:.4g} (one factor for the clip)"
    )
    phase = phases(truth.motion)
    return _compared(run, Reference("true", what, rest, truth.xyz, truth.xy, truth.visible, phase, "mm", scale))


def _compared(run: Run, to: Reference) -> dict[str, dict[str, Any]]:
    """Displacements of the replay against the reference's, by part of the recording."""
    path = carried(run.replay, run.body, to.rest)
    on_body = np.isfinite(path).all((1, 2))
    pixels = np.where(on_body[:, None, None], run.camera.project(np.where(np.isfinite(path), path, 1.0)), np.nan)
    moved, moved_px = to.scale * _from_start(path), _from_start(pixels)
    wanted, wanted_px = _from_start(to.xyz), _from_start(to.xy)
    counted = to.visible & on_body[:, None] & np.isfinite(wanted).all(-1)
    counted[:, 0] = False
    far = np.where(counted, np.linalg.norm(wanted, axis=-1), 0).max(1, initial=0)
    lively = (far >= MOVING * np.percentile(far[on_body], 95))[:, None] if on_body.any() else on_body[:, None]
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
        of_moving = f"mean over points that move at least {MOVING:.0%} of the liveliest ones' way, {how}"
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


def _from_start(path: np.ndarray) -> np.ndarray:
    return path.astype(np.float64) - path[:, :1]


def _stated(run: Run) -> dict[str, dict[str, Any]]:
    """What estimation itself measured on frames it never fitted."""
    said = "stated by estimation: mean distance of moving tracked points, across the view where depth is a guess, on "
    return {
        f"fit_{name}": number(None if value is None else 1e3 * value, run.length_unit, said + where)
        for name, where in STATED.items()
        for value in [run.fit.held_out.get(name)]
    }
