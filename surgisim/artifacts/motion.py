"""Where grasped tissue went: the boundary condition of a replay."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from surgisim.artifacts.base import Artifact, check


@dataclass(frozen=True)
class Motion(Artifact):
    """J grips, each a ball of tissue that is carried without turning while it is active."""

    center_rest: np.ndarray
    """Centre of the gripped ball in frame 0, camera frame [m], (J, 3)."""
    radius: np.ndarray
    """Its radius [m], (J,)."""
    position: np.ndarray
    """Where its centre is carried, camera frame [m], (J, T, 3)."""
    active: np.ndarray
    """Whether the instrument holds it, (J, T) bool."""
    confidence: np.ndarray
    """How sure we are that this is a grasp, 0-1, (J,)."""
    source: Literal["found", "given", "none"]
    late: np.ndarray | None = None
    """How many frames after its last active one each grip opens, before it where negative, (J,); 0 if None [frames]."""
    rim: np.ndarray | None = None
    """Where patches of the tissue at the edge of what is seen go with what lies beyond it, camera frame [m], (E, T, 3),
    from their place at rest on. No patch if None."""
    rim_radius: np.ndarray | None = None
    """Radius of each patch's ball [m], (E,)."""

    UNITS = {
        "center_rest": "m",
        "radius": "m",
        "position": "m",
        "confidence": "1",
        "late": "frames",
        "rim": "m",
        "rim_radius": "m",
    }

    def __post_init__(self) -> None:
        j = self.center_rest.shape[0]
        if self.late is None:
            object.__setattr__(self, "late", np.zeros(j))
        t = self.active.shape[-1]
        if self.rim is None or not len(self.rim):
            object.__setattr__(self, "rim", np.zeros((0, t, 3)))
            object.__setattr__(self, "rim_radius", np.zeros(0))
        shapes = [self.center_rest.shape, self.radius.shape, self.position.shape, self.active.shape, self.late.shape]
        check(
            shapes == [(j, 3), (j,), (j, t, 3), (j, t), (j,)],
            f"Motion: shapes {shapes} do not fit; (J, 3), (J,), (J, T, 3), (J, T), (J,) are wanted.",
        )
        edge = [self.rim.shape, self.rim_radius.shape]
        e = len(self.rim_radius)
        check(edge == [(e, t, 3), (e,)], f"Motion: the rim's shapes {edge} do not fit; (E, T, 3), (E,) are wanted.")
        check(bool(np.isfinite(self.position).all() and np.isfinite(self.rim).all()), "Motion: places must be finite.")

    def on_rim(self, points: np.ndarray) -> np.ndarray:
        """Whether points at rest, camera frame [m], (K, 3), lie in a patch of the rim, (K,) bool."""
        away = np.linalg.norm(points[:, None] - self.rim[:, 0], axis=-1)
        return (away <= self.rim_radius).any(1)
