"""How far a grip's path is off, toward the camera included, as a share of its length."""

from typing import Any

import numpy as np

from surgisim.artifacts.motion import Motion
from surgisim.measure.grasp_error import nearest
from surgisim.measure.groups.depth import scale_to_truth
from surgisim.measure.number import number, ranged
from surgisim.measure.resample import Estimate, ratio
from surgisim.measure.run import Run
from surgisim.measure.spans import SPANS, phases_of, within

VIEWS = {
    "": (slice(0, 3), ""),
    "_across": (slice(0, 2), ", across the view only"),
    "_along": (slice(2, 3), ", along it only"),
}


def grip_path(run: Run) -> dict[str, dict[str, Any]]:
    """Of the grip that tracking found, and of the one that estimation fitted, both against the true one."""
    truth = run.truth
    if truth is None or not len(truth.motion.radius):
        return {}
    numbers = {}
    for name, motion in (("found", run.found), ("fitted", run.motion)):
        if motion is not None:
            numbers |= _of(run, motion, name)
    return numbers


def _of(run: Run, motion: Motion, name: str) -> dict[str, dict[str, Any]]:
    true, scale, phase = run.truth.motion, scale_to_truth(run), phases_of(run)
    if not len(motion.radius):
        return {f"path_{name}_pull_share": number(None, "%", "", why_not="no grasp was found")}
    numbers = {}
    for span in ("load", "hold", "pull"):
        words = SPANS[span][1]
        for view, (axes, where) in VIEWS.items():
            off, shares = [], []
            for j, held in enumerate(true.active):
                i = nearest(motion, true, j, scale)
                moved = true.position[j] - true.center_rest[j]
                found = scale * (motion.position[i] - motion.center_rest[i])
                both = held & motion.active[i] & within(phase, span)
                off.append(((found - moved)[both][:, axes] ** 2).sum(-1))
                shares.append(off[-1] / _length(true.position[j][held]) ** 2)
            how = (
                f"root mean square distance between displacements since rest{where}, of the grip's true path and of "
                f"the one {name}, {words}, frames in which both hold; lengths times {scale:.4g} (one factor for the "
                "clip)"
            )
            why_not = f"no frame in which both hold {words}"
            numbers[f"path_{name}_{span}{view}"] = ranged(
                _rms(off), "mm", how, factor=1e3, drawn="frames", why_not=why_not
            )
            numbers[f"path_{name}_{span}{view}_share"] = ranged(
                _rms(shares), "%", f"{how}; as a share of the true path's length, z included", factor=100,
                drawn="frames", why_not=why_not,
            )  # fmt: skip
    return numbers


def _rms(squares: list[np.ndarray]) -> Estimate:
    together = np.concatenate(squares)
    return ratio(together, np.ones(len(together)), root=True)


def _length(path: np.ndarray) -> float:
    """Length of a path while it holds, (T, 3) [m]."""
    way = float(np.linalg.norm(np.diff(path, axis=0), axis=-1).sum())
    return way if way > 0 else float("nan")
