"""Recordings drawn from the diagnosis' own model of a recording: what it says of them is what it says of nothing.

A draw is the base's motion with everything that a residual may hold beside physics: nuisances at random prior values, a
base of other numbers, a constant of each point, noise. Of the base only fitted frames know slopes (base.py); and as
slopes are those of small changes, its numbers are drawn as surely as the recording tells them, not from their prior.
"""

import numpy as np

from surgisim.diagnosis.context import Case


def drawn(case: Case, rng: np.random.Generator) -> np.ndarray:
    """Displacement of the points as a case's model of noise and nuisances has it [m], (K, T, 3)."""
    clip, base = case.clip, case.base
    moved = base.simulated + case.noise.draw(clip.rest, clip.frames, rng)
    if clip.error is not None:
        moved = moved + clip.error
    for group in case.groups:
        moved = moved + np.tensordot(rng.standard_normal(len(group.columns)), group.columns, (0, 0))
    near = np.sqrt(np.diag(base.known.near)) / clip.prior.spread
    share = np.minimum(near, 1.0) * rng.standard_normal(len(base.slopes))
    moved[:, : clip.until] += np.tensordot(share, base.slopes, (0, 0))
    if case.settings.offsets:
        moved = moved + case.noise.scale[:, None] * rng.standard_normal((len(clip.rest), 1, 3))
    return moved
