"""How far the CHANGE of depth of moving tissue is off: what a pull toward the camera shows in, and a scale hides."""

from typing import Any

import numpy as np
from scipy.ndimage import map_coordinates

from surgisim.measure.compared import OF_MOVING, compared, from_start, moving
from surgisim.measure.groups.depth import scale_to_truth
from surgisim.measure.groups.masking import NO_TRUTH
from surgisim.measure.number import ranged
from surgisim.measure.reference import true
from surgisim.measure.resample import NOTHING, ratio
from surgisim.measure.run import Run
from surgisim.measure.spans import SPANS, phases_of, within


def depth_change(run: Run) -> dict[str, dict[str, Any]]:
    """Of the depth stage at the points' own pixels, and of the replay; against the truth, or the given depth."""
    numbers = {}
    tracks, phase = run.tracks, phases_of(run)
    if len(run.given.depth):
        moved = sampled(run.given.depth, tracks.xy)
        what = "visible tracks, against the depth that came with the recording at their own pixels"
        found = sampled(run.depth.z, tracks.xy)
        counted = tracks.visible & tracks.visible[:, :1] & np.isfinite(moved)
        across = from_start(tracks.xy)
        lively = moving(across, counted, counted.any(1))
        # A missing depth is written as 0, in frame 0 too.
        counted = counted & (moved > 0) & (moved[:, :1] > 0) & lively
        numbers |= _against(from_start(moved), from_start(found), counted, phase, "given_change", what)
    truth, to = run.truth, true(run)
    if truth is None or to is None:
        return numbers | {"change_pull": ranged(NOTHING, "mm", "", why_not=NO_TRUTH)}
    scale = scale_to_truth(run)
    times = f", lengths times {scale:.4g} (one factor for the clip)" if scale != 1 else ""
    counted = truth.visible & truth.visible[:, :1]
    counted[:, 0] = False
    wanted = from_start(truth.xyz)
    counted &= moving(wanted, counted, counted.any(1))
    found = scale * from_start(sampled(run.depth.z, truth.xy))
    what = f"true points visible in that frame, depth taken at their true pixels{times}"
    numbers |= _against(wanted[..., 2], found, counted, phase, "change", what)
    if len(run.replay.time) == run.camera.frames:
        by = compared(run, to)
        what = f"true points visible in that frame, carried by the replay{times}"
        replayed = by.counted & by.lively
        numbers |= _against(by.wanted[..., 2], by.ours[..., 2], replayed, phase, "replay_change", what)
    return numbers


def sampled(depth: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """Depth (T, H, W) along pixel paths (K, T, 2), between pixels, (K, T) [m]; NaN outside of the picture."""
    count, height, width = depth.shape
    place = np.where(np.isfinite(xy), xy, -1e3)
    inside = ((place > -0.5) & (place < [width - 0.5, height - 0.5])).all(-1)
    values = [
        map_coordinates(depth[t].astype(float), place[:, t, ::-1].T, order=1, mode="nearest") for t in range(count)
    ]
    return np.where(inside, np.stack(values, 1), np.nan)


def _against(
    wanted: np.ndarray, found: np.ndarray, counted: np.ndarray, phase: np.ndarray, name: str, what: str
) -> dict[str, dict[str, Any]]:
    """Root mean squares of the error and of the true change (K, T), and the one as a share of the other."""
    numbers = {}
    for span, (_, words) in SPANS.items():
        here = counted & within(phase, span) & np.isfinite(found)
        off = np.where(here, (found - wanted) ** 2, 0).sum(1)
        change = np.where(here, wanted**2, 0).sum(1)
        how = f"change of depth since frame 0 of {OF_MOVING}, {words}: {what}"
        why_not = f"no moving point is seen {words}"
        numbers[f"{name}_{span}"] = ranged(
            ratio(off, here.sum(1), root=True), "mm", f"root mean square error of the {how}", factor=1e3,
            why_not=why_not,
        )  # fmt: skip
        numbers[f"{name}_{span}_true"] = ranged(
            ratio(change, here.sum(1), root=True), "mm", f"root mean square of the true {how}", factor=1e3,
            why_not=why_not,
        )  # fmt: skip
        numbers[f"{name}_{span}_share"] = ranged(
            ratio(off, change, root=True), "%",
            f"root mean square error as a share of the true {how}; 100 % is said by a depth that never changes",
            factor=100, why_not=why_not,
        )  # fmt: skip
    return numbers
