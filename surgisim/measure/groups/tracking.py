"""Whether tracked points stayed on their piece of tissue."""

from typing import Any

import numpy as np

from surgisim.measure.distance import distance, distance_over_time
from surgisim.measure.flow_at import flow_at
from surgisim.measure.groups.depth import scale_to_truth
from surgisim.measure.groups.masking import NO_TRUTH
from surgisim.measure.number import number
from surgisim.measure.run import Run

HOW = (
    "true points visible in that frame; their found place is the tracks' displacement interpolated linearly at the "
    "point's pixel in frame 0 (Delaunay triangles of the visible tracks); frame 0 left out"
)


def tracking(run: Run) -> dict[str, dict[str, Any]]:
    tracks = run.tracks
    numbers = {
        "points": number(len(tracks.xy), "1", "points tracked from frame 0"),
        "visible": number(tracks.visible.mean() if tracks.visible.size else None, "1", "point-frames seen"),
        "sigma": number(
            np.median(tracks.sigma[tracks.visible]) if tracks.visible.any() else None,
            "px",
            "the stage's own standard deviation, median over visible point-frames",
        ),
    }
    if run.truth is None:
        return numbers | {"median": number(None, "px", "", why_not=NO_TRUTH)}
    truth = run.truth
    counted = truth.visible.copy()
    counted[:, 0] = False
    found = flow_at(truth.xy[:, 0], tracks.xy, tracks.visible)
    apart = distance(found, truth.xy, counted)
    lifted = flow_at_space(run)
    still = distance(np.broadcast_to(truth.xy[:, :1], truth.xy.shape), truth.xy, counted)
    scale = scale_to_truth(run)
    space = distance(scale * lifted, truth.xyz, counted & np.isfinite(found).all(-1))
    return numbers | {
        "median": number(apart.median, "px", f"median over {HOW}", series=distance_over_time(found, truth.xy, counted)),
        "mean": number(apart.mean, "px", f"mean over {HOW}"),
        "still_mean": number(still.mean, "px", "mean if every point were said to stay where it is in frame 0"),
        "answered": number(
            apart.count / max(counted.sum(), 1), "1", "visible true point-frames inside a triangle of tracks"
        ),
        "space_median": number(
            1e3 * space.median,
            "mm",
            f"median in space, lengths times {scale:.4g} (one factor for the clip), over {HOW}",
        ),
    }


def flow_at_space(run: Run) -> np.ndarray:
    """Found places of the true points in space [m], (K, T, 3): the found pixel lifted with the run's depth."""
    truth, z = run.truth, run.depth.z
    found = flow_at(truth.xy[:, 0], run.tracks.xy, run.tracks.visible)
    known = np.isfinite(found).all(-1)
    place = np.where(known[..., None], found, 0.0)
    column = np.clip(np.rint(place[..., 0]).astype(int), 0, z.shape[2] - 1)
    row = np.clip(np.rint(place[..., 1]).astype(int), 0, z.shape[1] - 1)
    lifted = run.camera.lift(place, z[np.arange(z.shape[0])[None], row, column])
    return np.where(known[..., None], lifted, np.nan)
