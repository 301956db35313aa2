"""Follow points by a network such as CoTracker, loaded as TorchScript from a path; never from the net.

The network maps a video (1, T, 3, H, W) float32 0-255 and queries (1, K, 3) of frame, x, y to tracks (1, T, K, 2) [px]
and visibility (1, T, K), as CoTracker's offline predictor does (Karaev and others, CoTracker3, 2024).
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from surgisim.artifacts.correspondence import Correspondence
from surgisim.config.tracking import Tracking
from surgisim.perception.torchscript import torchscript
from surgisim.perception.tracking import Paths
from surgisim.problem import Problem

SIGMA = 0.5
"""Standard deviation of a point the network says it sees [px]."""
ELSEWHERE = (
    "CoTracker is published as facebookresearch/co-tracker (scaled_offline.pth, to be traced to TorchScript); set "
    "tracking.weights to the traced file, or tracking.backend to 'flow_chain', which needs no weights."
)


def track(
    rgb: np.ndarray,
    surface: Correspondence,
    specular: np.ndarray,
    queries: np.ndarray,
    *,
    settings: Tracking,
    progress: Callable[[float, float, str], None] | None = None,
) -> Paths:
    """Where `queries` of frame 0, (K, 2) [px], went; a point behind the instrument is not seen."""
    import torch

    network = _load(settings.weights)
    video = torch.from_numpy(rgb.transpose(0, 3, 1, 2)[None].astype(np.float32))
    asked = torch.from_numpy(np.insert(queries, 0, 0.0, axis=1)[None].astype(np.float32))
    with torch.inference_mode():
        found, seen = network(video, asked)[:2]
    xy = found[0].numpy().swapaxes(0, 1).astype(np.float32)
    seen = seen[0].numpy().T
    seen = seen if seen.dtype == bool else seen > 0.5
    want = (len(queries), len(rgb))
    if xy.shape != (*want, 2) or seen.shape != want or not np.isfinite(xy).all():
        raise Problem(
            f"tracking: the network in {settings.weights} gives tracks {xy.shape}, visibility {seen.shape}; finite "
            f"{(*want, 2)} and {want} are wanted. {ELSEWHERE}"
        )
    near = np.rint(xy).astype(int)
    inside = (near >= 0).all(-1) & (near[..., 0] < rgb.shape[2]) & (near[..., 1] < rgb.shape[1])
    x, y = np.where(inside, near[..., 0], 0), np.where(inside, near[..., 1], 0)
    visible = seen & inside & ~surface.hidden[np.arange(len(rgb)), y, x]
    if progress:
        progress(1, 1, "points followed")
    return Paths(xy, visible, np.where(visible, SIGMA, 10 * SIGMA).astype(np.float32))


def _load(weights: Path | None):
    if weights is None:
        raise Problem(f"tracking: backend 'cotracker' needs the setting tracking.weights. {ELSEWHERE}")
    if not weights.is_file():
        raise Problem(f"tracking: backend 'cotracker' looks for {weights}, and there is no such file. {ELSEWHERE}")
    return torchscript(weights, export=ELSEWHERE)
