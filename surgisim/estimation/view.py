"""The same recording seen through another lens, or of tissue of another shape: every point slid along its ray."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.motion import Motion
from surgisim.estimation.lay import Columns
from surgisim.estimation.observation import Filmed
from surgisim.estimation.search import Search


@dataclass(frozen=True)
class View:
    """How the tissue lies before a camera, as factors of what was taken for granted; pixels stay what they are."""

    camera: Camera
    """As it was taken to be."""
    middle: np.ndarray
    """Where the surface stays at its depth, as tangents from the axis, (2,)."""
    lens: float = 1.0
    """Focal length over that."""
    right: float = 0.0
    """Change of log depth for one unit of tangent to the right [1]."""
    down: float = 0.0
    """The same downward [1]."""
    bowl: float = 0.0
    """Change of log depth for the squared distance from the middle [1]."""

    @property
    def seen_by(self) -> Camera:
        """The camera of this view."""
        return replace(self.camera, fx=self.camera.fx * self.lens, fy=self.camera.fy * self.lens)

    def factor(self, points: np.ndarray) -> np.ndarray:
        """What brings tissue at points, camera frame [m], (..., 3), to where it lies in this view, (..., 3)."""
        x, y = np.moveaxis(points[..., :2] / points[..., 2:] - self.middle, -1, 0)
        nearer = np.exp(self.right * x + self.down * y + self.bowl * (x**2 + y**2))
        return nearer[..., None] * [1 / self.lens, 1 / self.lens, 1.0]

    def motion(self, found: Motion) -> Motion:
        """How the instruments carry tissue in this view: each grip's whole path is brought along with its start.

        A held ball is as large as it was: how large it is, is a number of the fit."""
        factor, edge = self.factor(found.center_rest), self.factor(found.rim[:, 0])
        return replace(
            found,
            center_rest=found.center_rest * factor,
            position=found.position * factor[:, None],
            rim=found.rim * edge[:, None],
        )

    def alike(self, x: np.ndarray, wanted: Search) -> np.ndarray:
        """Numbers, (M,), with which tissue moves in this view much as it did at x: each length is as much shorter as
        the picture is narrower, and moduli and viscosities go with its square, where density and times are known."""
        narrower, count = -np.log(self.lens), len(wanted.free)
        moved = x.copy()
        for k, (*_, p) in enumerate(wanted.free):
            moved[k] += 2 * narrower * (p.logarithmic and p.unit in ("Pa", "Pa s"))
        for k, u in enumerate(wanted.open, count):
            if u.unit == "m" and u.logarithmic:
                moved[k] += narrower
            elif u.name.endswith((".right", ".down")):
                moved[k] /= self.lens
        return moved

    def observation(self, seen: Filmed) -> Filmed:
        """What is compared in this view; what one standard deviation is in the picture stays."""
        factor = self.factor(seen.rest)[:, None]
        light = seen.light.placed(seen.light.rest * self.factor(seen.light.rest)) if seen.light else None
        return replace(
            seen,
            rest=seen.rest * factor[:, 0],
            displacement=seen.displacement * factor,
            weight=seen.weight / factor,
            camera=self.seen_by,
            light=light,
        )

    def columns(self, laid: Columns) -> Columns:
        """The body in this view, as thick as it was."""
        top = np.concatenate([laid.xy, laid.above[:, None]], 1)
        factor = self.factor(top)
        ends = laid.torn.reshape(-1, 2)
        near = cKDTree(laid.xy).query(ends)[1]
        torn = (ends * factor[near, :2]).reshape(laid.torn.shape)
        return replace(
            laid,
            xy=laid.xy * factor[:, :2],
            begin=laid.begin + laid.above * (factor[:, 2] - 1),
            above=laid.above * factor[:, 2],
            area=laid.area * factor[:, 0] * factor[:, 1],
            torn=torn,
        )
