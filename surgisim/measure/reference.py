"""Where points of the tissue went, to compare a replay with: the tracks, or on an invented clip the truth."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.motion import Motion
from surgisim.measure.groups.depth import scale_to_truth
from surgisim.measure.phases import phases
from surgisim.measure.run import Run


@dataclass(frozen=True)
class Reference:
    """Where points went, to compare a replay with."""

    name: str
    what: str
    rest: np.ndarray
    """Where the run's own body has them in frame 0 [m], (K, 3); NaN where it has not."""
    xyz: np.ndarray
    """[m], (K, T, 3)."""
    xy: np.ndarray
    """[px], (K, T, 2)."""
    visible: np.ndarray
    """(K, T) bool."""
    motion: Motion
    """How they are gripped, in the reference's lengths [m]."""
    focal: tuple[float, float]
    """That goes with xyz and xy [px]."""
    unit: str
    scale: float = 1.0
    """Factor from the run's lengths to the reference's [1]."""

    @property
    def way(self) -> np.ndarray:
        """The paths by which it is told whether a point moves, (K, T, 3) [m] or (K, T, 2) [px]."""
        # A track's depth is estimated, and another one would call other points moving.
        return self.xyz if self.name == "true" else self.xy

    @property
    def phase(self) -> np.ndarray:
        """(T,) str."""
        return phases(self.motion)


def tracked(run: Run) -> Reference:
    """The run's own tracks."""
    tracks, camera = run.tracks, run.camera
    rest = np.where(tracks.visible[:, :1], tracks.xyz[:, 0], np.nan)
    what = "visible tracks (themselves estimated), each carried by the replay from its place in frame 0"
    if not run.depth.follows:
        what += "; their way along the view is a guess from brightness, no measurement"
    return Reference(
        "tracked", what, rest, tracks.xyz, tracks.xy, tracks.visible, run.motion, (camera.fx, camera.fy),
        run.length_unit,
    )  # fmt: skip


def true(run: Run) -> Reference | None:
    """The true points of an invented clip; None for a recording."""
    truth = run.truth
    if truth is None:
        return None
    pixel = truth.xy[:, 0]
    column = np.clip(np.rint(pixel[:, 0]).astype(int), 0, run.camera.width - 1)
    row = np.clip(np.rint(pixel[:, 1]).astype(int), 0, run.camera.height - 1)
    rest = run.camera.lift(pixel, run.depth.z[0, row, column])
    scale = scale_to_truth(run)
    what = (
        "true points visible in that frame, lifted from their pixel in frame 0 with the run's depth and carried by "
        f"the replay; displacements in space times {scale:.4g} (one factor for the clip)"
    )
    return Reference(
        "true", what, rest, truth.xyz, truth.xy, truth.visible, truth.motion, (truth.focal, truth.focal), "mm", scale
    )
