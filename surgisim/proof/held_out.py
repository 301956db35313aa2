"""What the named law gains on the manipulation that was never fitted, beside the most that could be gained.

All errors are RMS lengths over the visible points that the diagnosis used, in the frames held out, after each point's
mean over the rest before the first grasp is taken off, because a point's reference offset is the tracker's and not the
tissue's. What lies along an axis of which the recording is less sure counts as much less. In mm.

    oracle        recorded minus the phantom's own noise-free path with the effects: law, numbers and solver all true
    oracle_before the same without the effects
    noise_floor   the tracking noise; one number with `oracle`, in which nothing but noise is left
    share         (before - after) / (before - oracle): what the diagnosis cuts of what the oracle would
    share_effect  (before - after) / (oracle_before - oracle): the same over what the effect itself adds
    placebo_better   whether the placebo's error is smaller, by however little that single precision tells
    shows         whether the effect is there at all: at least as large as the tracking noise in these frames

The oracle is another solver than the one that diagnoses, so that `share` also counts the engine's own error.
"""

import numpy as np

from surgisim.artifacts.diagnosis import ALIKE
from surgisim.artifacts.mismatch import Mismatch
from surgisim.artifacts.verdict import Verdict
from surgisim.problem import Problem
from surgisim.proof.truth import Truth
from surgisim.recordings.recording import Recording

LEAST = 3
"""Frames of rest that an offset is told from; where a point is seen in fewer, from all frames that may be fitted."""


def rms(residual: np.ndarray, rest: slice, frames: slice) -> float:
    """RMS length of residuals [m], (K, T, 3), NaN where unseen, in `frames`, each point's mean in `rest` off [mm]."""
    seen = np.isfinite(residual).all(-1)
    known = np.where(seen[..., None], residual, 0.0)

    def mean(span: slice) -> tuple[np.ndarray, np.ndarray]:
        count = seen[:, span].sum(1)
        return known[:, span].sum(1) / np.maximum(count, 1)[:, None], count

    (offset, count), (instead, _) = mean(rest), mean(slice(0, frames.start))
    offset = np.where((count >= LEAST)[:, None], offset, instead)
    off = (known - offset[:, None])[:, frames][seen[:, frames]]
    return 1e3 * float(np.sqrt((off**2).sum(-1).mean()))


def held_out(truth: Truth, recording: Recording, verdict: Verdict, mismatch: Mismatch | None) -> dict | None:
    """The errors; None where no frame is held out. `before` and `after` are the mismatch's, or else as stated."""
    span = recording.held_out
    if span[0] >= span[1]:
        return None
    held = recording.motion.active.any(0)
    parts = slice(0, int(held.argmax()) if held.any() else span[0]), slice(*span)
    points, used = recording.points.astype(float), _used(recording, mismatch)
    floor, before = (rms(recording.told_of(points - paths)[used], *parts) for paths in (truth.true, truth.plain))
    result = {"oracle": floor, "noise_floor": floor, "oracle_before": before}
    told = verdict.held_out
    if mismatch is None:
        result |= {"before": told.get("before"), "after": told.get("after"), "source": "stated"}
    else:
        result |= {
            "before": rms(mismatch.residual_before, *parts),
            "after": rms(mismatch.residual_after, *parts),
            "source": "mismatch.npz",
        }
    result |= {"placebo": told.get("placebo"), "flexible": told.get("flexible"), "stated": dict(told)}
    before, after = result["before"], result["after"]
    gain = None if before is None else before - floor
    result["share"] = (before - after) / gain if gain and gain > 0 and after is not None else None
    shows = truth.told["snr_held_out"] >= 1
    effect = result["oracle_before"] - floor
    result |= {"shows": shows, "share_effect": (before - after) / effect if shows and after is not None else None}
    placebo, said = told.get("placebo"), told.get("after")
    # Both as stated, so that they are measured the same way.
    result["placebo_better"] = None if placebo is None or said is None else bool(placebo < said - ALIKE)
    return result


def _used(recording: Recording, mismatch: Mismatch | None) -> np.ndarray:
    """Which of the recording's points the diagnosis used, in its order; all where that is not known."""
    rest = recording.attached()
    if mismatch is None:
        return np.arange(len(rest))
    away = np.linalg.norm(mismatch.points[:, None] - rest[None], axis=-1)
    if away.min(1).max() > 1e-5:
        raise Problem(
            f"mismatch.npz has a point {1e3 * away.min(1).max():.2g} mm from any of recording {recording.name}. "
            "Score files of one case."
        )
    return away.argmin(1)
