"""How the colour of each Gaussian changes through the clip: what light does and no motion explains.

    c_i(t) = c_i + sum_k h_k(t) w_ik

h_k are hat functions at K knots, spread evenly over the frames that are looked at: none lies where no frame tells its
colours, so what is between two frames is between their colours. There is none at the first, whose colours are the
scene's own. A lamp at the camera lights tissue otherwise as it turns and comes nearer, and its highlights stay where
they are while tissue passes under them. The paper's field changes no colour: there motion has to make up for it.
"""

from collections.abc import Sequence

import numpy as np
import torch


def clock(time: float, moments: np.ndarray) -> float:
    """How many of the frames that are looked at have gone by, 0-1; moments: when they were taken [s], (M,)."""
    return float(np.interp(time, moments, np.linspace(0.0, 1.0, len(moments))))


def knots(often: float, frames: int) -> int:
    """How many there are at so many a frame."""
    return max(1, round(often * (frames - 1)))


def shares(gone: float, count: int) -> dict[int, float]:
    """Which of `count` knots tell of a moment, 0-1 of the frames, and the share of each; none at the first."""
    at = min(max(gone, 0.0), 1.0) * count
    last = min(int(at), count - 1)
    told = {last - 1: 1.0 - (at - last), last: at - last}
    return {k: share for k, share in told.items() if k >= 0 and share > 0}


def tint(at_knots: Sequence[Sequence[torch.Tensor]], gone: Sequence[float]) -> torch.Tensor:
    """What is added to the colours, sRGB 0-1, at B moments, (B, G, 3), of what each scale is at its knots, (G, 3) each;
    0 at the first moment."""
    nothing = torch.zeros_like(at_knots[0][0])
    told = [[(scale[k], share) for scale in at_knots for k, share in shares(g, len(scale)).items()] for g in gone]
    parts = [part for one in told for part in one]
    if not parts:
        return torch.stack([nothing] * len(gone))
    # All at once: a GPU waits for each that it is told of.
    shared = iter(torch._foreach_mul([a for a, _ in parts], [share for _, share in parts]))
    each = [[next(shared) for _ in one] for one in told]
    return torch.stack([torch.stack(one).sum(0) if one else nothing for one in each])
