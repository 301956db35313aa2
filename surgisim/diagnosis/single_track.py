"""Whether a law rests on one point's track alone."""

from surgisim.diagnosis.context import Case
from surgisim.diagnosis.errors import residual
from surgisim.diagnosis.refit import Refit

SHARE, FEW = 0.9, 12
"""Share of what a law takes off plain errors that one point has beyond which the law rests on its track alone, and
points below which that is not asked; chosen."""


def single_track(case: Case, refit: Refit) -> int | None:
    """Number, among a clip's points, of the one whose track alone asks for a law.

    None where others do too, where points are few, or of a video.

    What tissue does at one point it does around it too; what one track alone says may as well be the tracker's.
    """
    clip, until = case.clip, case.clip.until
    if clip.recording.astray or len(clip.kept) < FEW:
        return None
    both = case.base.simulated, case.base.simulated + refit.response
    before, left = (residual(case, s, False, rest_only=False)[:, :until] for s in both)
    gain = ((before**2).sum((1, 2)) - (left**2).sum((1, 2))) / case.noise.each**2
    k = int(gain.argmax())
    return k if gain.sum() > 0 and gain[k] > SHARE * gain.sum() else None
