"""What the named law gains on the manipulation that was never fitted, beside the most that could be gained.

All errors are RMS lengths over the visible points that the diagnosis used, in the frames held out, after each point's
mean over them is taken off, because a point's reference offset is the tracker's and not the tissue's. In mm.

    oracle        recorded minus the phantom's own noise-free path with the effects: law, numbers and solver all true
    oracle_before the same without the effects
    noise_floor   the tracking noise; one number with `oracle`, in which nothing but noise is left
    share         (before - after) / (before - oracle): what the diagnosis cuts of what the oracle would

The oracle is another solver than the one that diagnoses, so that `share` also counts the engine's own error.
"""

import numpy as np

from surgisim.artifacts.mismatch import Mismatch
from surgisim.artifacts.verdict import Verdict
from surgisim.problem import Problem
from surgisim.proof.truth import Truth
from surgisim.recordings.recording import Recording


def rms(residual: np.ndarray) -> float:
    """RMS length of residuals [m], (K, T, 3), NaN where unseen, each point's own mean taken off [mm]."""
    seen = np.isfinite(residual).all(-1)
    kept = seen.sum(1) > 1
    mean = np.zeros((len(residual), 1, 3))
    mean[kept, 0] = [r[s].mean(0) for r, s in zip(residual[kept], seen[kept], strict=True)]
    return 1e3 * float(np.sqrt(((residual - mean)[kept][seen[kept]] ** 2).sum(-1).mean()))


def held_out(truth: Truth, recording: Recording, verdict: Verdict, mismatch: Mismatch | None) -> dict | None:
    """The errors; None where no frame is held out. `before` and `after` are the mismatch's, or else as stated."""
    span = (recording.split or {}).get("held_out", (0, 0))
    frames = slice(*span)
    if span[0] >= span[1]:
        return None
    points, used = recording.points.astype(float), _used(recording, mismatch)
    floor = rms((points - truth.true)[used, frames])
    result = {"oracle": floor, "noise_floor": floor, "oracle_before": rms((points - truth.plain)[used, frames])}
    told = verdict.held_out
    if mismatch is None:
        result |= {"before": told.get("before"), "after": told.get("after"), "source": "stated"}
    else:
        result |= {
            "before": rms(mismatch.residual_before[:, frames]),
            "after": rms(mismatch.residual_after[:, frames]),
            "source": "mismatch.npz",
        }
    result |= {"placebo": told.get("placebo"), "flexible": told.get("flexible"), "stated": dict(told)}
    before, after = result["before"], result["after"]
    gain = None if before is None else before - floor
    result["share"] = (before - after) / gain if gain and gain > 0 and after is not None else None
    placebo, said = told.get("placebo"), told.get("after")
    # Both as stated, so that they are measured the same way.
    result["placebo_better"] = None if placebo is None or said is None else bool(placebo < said)
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
