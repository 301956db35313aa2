"""Frames that are not looked at: half way between those beside them, where what was seen goes straight on.

Between frames a and b lies one that nothing tells of. A surface that goes on as it went is half way there; one that is
let go in between is not, and its speeds before a and after b tell:

    s = (1 - |v_after - v_before| / (|v_after| + |v_before| + e))^2

s is 1 at one speed and 0 where what stood still goes, or the other way round. Where a pixel is not followed, s is that
of all that is followed then: what is let go is lost to tracks just then.
"""

import numpy as np
import torch

from surgisim.deformation.field import Field

STILL = 0.001
"""e: what a frame's motion is made of at least, for tracks are no better [longest image side]."""
UNTOLD = 0.1
"""s in a frame that nothing tells of: asked for more, a field that pictures alone tell of goes wrong."""


def straightness(frame: np.ndarray, unseen: np.ndarray, went: torch.Tensor, sure: torch.Tensor) -> torch.Tensor:
    """s of frame 0's pixels where nothing is looked at, (N, H, W), half precision; UNTOLD where nothing tells of it.

    frame: numbers of the frames that are looked at, (U,); unseen: of the others, before the last of these, (N,).
    went: how far frame 0's pixels were seen to go in the first [px], (U, H, W, 2). sure: how much that counts, 0-1,
    (U, H, W).
    """
    last, side = len(frame) - 1, max(went.shape[1:3])
    out = torch.full((len(unseen), *went.shape[1:3]), UNTOLD, dtype=went.dtype, device=went.device)
    for k, t in enumerate(unseen):
        b = int(np.searchsorted(frame, t))
        a = b - 1
        if a == 0 or b == last:
            continue
        before, after = ((went[j] - went[i]).float() / (frame[j] - frame[i]) for i, j in ((a - 1, a), (b, b + 1)))
        bent, most = (after - before).norm(dim=-1), after.norm(dim=-1) + before.norm(dim=-1) + STILL * side
        known = sure[a - 1 : b + 2].amin(0).float()
        if known.any():
            together = (known * bent).sum() / (known * most).sum()
            out[k] = (1 - torch.lerp(together, bent / most, known)).square()
    return out


def off_midway(
    field: Field, mean: torch.Tensor, moments: tuple[float, float, float], straight: torch.Tensor, unit: float
) -> torch.Tensor:
    """How far Gaussians at `mean` [m], (G, 3), are at the second of three moments [s] from between the first and the
    last: dmu in `unit` [m], and do, dR and dS as they are; a mean weighted by `straight`, 0-1, (G,)."""
    before, now, after = moments
    share = (now - before) / (after - before)
    with torch.no_grad():
        ends = field.at(mean, [before, after])
    here = field(mean, now)
    off = [here[k] - torch.lerp(ends[k][0], ends[k][1], share) for k in range(4)]
    moved, opacity, turn, grow = off
    each = moved.norm(dim=1) / unit + opacity.abs() + turn.abs().mean(1) + grow.abs().mean(1)
    return (straight * each).mean()
