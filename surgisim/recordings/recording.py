"""Tracked points of a body whose shape, holders and grips are known."""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from surgisim.artifacts.base import check
from surgisim.artifacts.body import Body
from surgisim.artifacts.motion import Motion
from surgisim.recordings.fill import fill
from surgisim.recordings.forces import Forces
from surgisim.recordings.mesh import Mesh
from surgisim.recordings.ways import told_of, turned


@dataclass(frozen=True, kw_only=True)
class Recording:
    """All in one frame of reference [m]; K points in T frames, B boxes, J grips."""

    name: str
    fps: float
    """[1/s]"""
    mesh: Mesh
    """Closed surface of the body at rest."""
    boxes: np.ndarray
    """Lower and upper corner of each region of rest space that is held still [m], (B, 2, 3)."""
    points: np.ndarray
    """Where each point was seen [m], (K, T, 3) float32, NaN where it was not."""
    visible: np.ndarray
    """(K, T) bool."""
    sigma: np.ndarray
    """Nominal noise of each point [m], (K,)."""
    motion: Motion
    """The grips; none where nothing was grasped."""
    density: float | None = None
    """[kg/m^3]"""
    gravity: tuple[float, float, float] | None = None
    """[m/s^2]"""
    tier: str = "tracks"
    starts: Literal["settled", "released"] = "settled"
    """What frame 0 is: the rest shape in equilibrium with gravity, or an unloaded shape that is let go there."""
    place: np.ndarray | None = None
    """Where each point sits on the body at rest [m], (K, 3), if not where it is first seen."""
    axes: np.ndarray | None = None
    """Each point's noise along each axis over `sigma` [1], (K, 3), of RMS 1, if not alike."""
    ways: np.ndarray | None = None
    """Directions of those axes, orthonormal rows for each point, (K, 3, 3), if not those of the frame."""
    doubts: dict[str, np.ndarray] = field(default_factory=dict)
    """How much farther each point would go were something otherwise by one standard deviation that body and grips were
    taken to be [m], (K, T, 3), by its name."""
    astray: float = 0.0
    """Of how far a point has gone, how far its track is off [1]."""
    expected: dict[str, tuple[float, float]] = field(default_factory=dict)
    """90 % intervals of what is known beforehand of the base's "E" [Pa], "eta / E" [s], and of "nu" where another
    recording's base told it, by their names."""
    split: dict[str, tuple[int, int]] | None = None
    """Frames `fit` and `held_out`, first and one past the last."""
    forces: Forces | None = None
    """Measured beside the points, where they were."""
    torn: np.ndarray = field(default_factory=lambda: np.zeros((0, 2, 2)))
    """Walls through which the body does not hang together, as `Body.torn`, (K, 2, 2) [m]."""

    def __post_init__(self) -> None:
        k, t = self.points.shape[:2] if self.points.ndim == 3 else (0, 0)
        shapes = [self.points.shape, self.visible.shape, self.sigma.shape, self.boxes.shape]
        check(
            shapes == [(k, t, 3), (k, t), (k,), (len(self.boxes), 2, 3)],
            f"recording {self.name}: shapes {shapes} do not fit; (K, T, 3), (K, T), (K,), (B, 2, 3) are wanted.",
        )
        check(t > 0 and k > 0, f"recording {self.name}: {k} points in {t} frames; at least one of each is wanted.")
        for name, moved in self.doubts.items():
            check(moved.shape == (k, t, 3), f"recording {self.name}: doubt '{name}' is {moved.shape}, not (K, T, 3).")
        grips = self.motion.active.shape[-1]
        check(grips == t, f"recording {self.name}: the grips have {grips} frames, the points {t}.")
        check(
            self.forces is None or self.forces.force.shape == (len(self.motion.active), t, 3),
            f"recording {self.name}: forces must be of each of its {len(self.motion.active)} grips in {t} frames.",
        )
        check(
            self.place is None or self.place.shape == (k, 3),
            f"recording {self.name}: 'place' must give a rest position for each of the {k} points.",
        )
        check(
            self.axes is None or self.axes.shape == (k, 3),
            f"recording {self.name}: 'axes' must give three shares of the noise for each of the {k} points.",
        )
        check(
            self.ways is None or (self.ways.shape == (k, 3, 3) and self.axes is not None),
            f"recording {self.name}: 'ways' must give the directions of 'axes' for each of the {k} points.",
        )

    @property
    def frames(self) -> int:
        return self.points.shape[1]

    @property
    def guessed(self) -> bool:
        """Whether body and grips were read off a video."""
        return bool(self.doubts) or self.astray > 0

    @property
    def noise(self) -> np.ndarray:
        """Nominal noise of each point along each of its axes [m], (K, 3)."""
        return self.sigma[:, None] * (np.ones((1, 3)) if self.axes is None else self.axes)

    def over_noise(self, field: np.ndarray) -> np.ndarray:
        """Displacements [m], (K, T, 3), along each point's axes over its noise there [1]."""
        return turned(field, self.ways) / self.noise[:, None]

    def told_of(self, field: np.ndarray) -> np.ndarray:
        """What the recording can tell of displacements [m], (K, T, 3)."""
        return told_of(field, self.axes, self.ways)

    def of(self, kept: np.ndarray | slice) -> "Recording":
        """Some of the points alone, as an index, (M,), or a slice chooses them."""
        names = ("points", "visible", "sigma", "place", "axes", "ways")
        chosen = {name: value[kept] for name in names if (value := getattr(self, name)) is not None}
        return replace(self, **chosen, doubts={name: moved[kept] for name, moved in self.doubts.items()})

    @property
    def fitted_until(self) -> int:
        """One past the last frame that may be fitted.

        The split's, or what precedes the second time that tissue is taken hold of, or seven tenths of the frames.
        """
        if self.split:
            return self.split["fit"][1]
        busy = self.motion.active.any(0)
        begins = np.flatnonzero(busy & ~np.r_[False, busy[:-1]])
        if len(begins) > 1 and begins[1] > 8:
            return int(begins[1]) - 2
        return max(1, round(0.7 * self.frames))

    @property
    def held_out(self) -> tuple[int, int]:
        """Frames that are not fitted and that the fit is held against, first and one past the last."""
        return self.split["held_out"] if self.split else (self.fitted_until, self.frames)

    def attached(self) -> np.ndarray:
        """Rest position that each point is taken to follow [m], (K, 3).

        `place`, or the mean over the frames before the first grasp; where it first is of a point that is not seen
        there, and of all where frame 0 lets an unloaded shape go or nothing is grasped.
        """
        if self.place is not None:
            return self.place
        first = self.visible.argmax(1)
        where = self.points[np.arange(len(first)), first].astype(float)
        rest = int(self.motion.active.any(0).argmax())
        seen = self.visible[:, :rest]
        known = seen.any(1) & (self.starts == "settled")
        total = np.where(seen[..., None], self.points[:, :rest].astype(float), 0.0).sum(1)
        return np.where(known[:, None], total / np.maximum(seen.sum(1), 1)[:, None], where)

    def body(self, spacing: float, raised: float = 0.0) -> Body:
        """Particles for a grid of `spacing` [m], those in the boxes held, which reach `raised` [m] further all round.

        Raises Problem where boxes that are drawn in hold nothing, or raised ones everything.
        """
        boxes = self.boxes + raised * np.array([-1.0, 1.0])[:, None]
        whole = fill(self.mesh, spacing=spacing, boxes=boxes, where=f"recording {self.name}")
        return replace(whole, torn=self.torn)


def no_grips(frames: int) -> Motion:
    """The motion of a recording in which nothing was grasped."""
    shape = (0, frames)
    return Motion(
        np.zeros((0, 3)), np.zeros(0), np.zeros((*shape, 3)), np.zeros(shape, bool), np.zeros(0), source="none"
    )
