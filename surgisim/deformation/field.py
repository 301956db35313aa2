"""Feature planes and head together: how far every Gaussian has moved at any time.

    (dmu, do, dR, dS) = head(features(mu, t))

mu in the space-time box; dmu in units of the box's half longest side; do added to the opacity's logit, dR to the
quaternion before it is made a unit again, dS to the logarithm of the radii, as in 4D Gaussian Splatting. The paper
adds dS without saying in which scale; the logarithm keeps radii positive.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import torch

from surgisim.artifacts.deformation import Deformation
from surgisim.deformation.planes import Layout, features
from surgisim.deformation.sheets import Sheets
from surgisim.deformation.smoothness import roughness
from surgisim.problem import Problem

OUTPUTS = (3, 1, 4, 3)
"""Numbers of dmu, do, dR, dS."""


@dataclass(frozen=True)
class Field:
    """A deformation field, ready to be evaluated or trained."""

    layout: Layout
    low: np.ndarray
    """Lower corner of the space-time box: x, y, z [m], t [s], (4,)."""
    high: np.ndarray
    """Upper corner, (4,)."""
    planes: torch.Tensor
    """All planes end to end; the sheets of them where there are `sheets`."""
    head: tuple[torch.Tensor, ...]
    """Weight matrices, each (out, in), without biases."""
    sheets: Sheets | None = None
    """How planes lie beside each other on a GPU."""
    box: tuple[torch.Tensor, torch.Tensor] | None = None
    """The box's lower corner and size in space [m], (3,) each, where the planes are."""

    def __call__(self, mean: torch.Tensor, time: float) -> tuple[torch.Tensor, ...]:
        """dmu [m] (G, 3), do (G,), dR (G, 4), dS (G, 3) of Gaussians resting at `mean` [m], (G, 3), at `time` [s].

        At the box's first moment nothing has moved, whatever the weights are.
        """
        return tuple(change[0] for change in self.at(mean, [time]))

    def at(self, mean: torch.Tensor, times: Sequence[float]) -> tuple[torch.Tensor, ...]:
        """The same at B times, with B in front: dmu (B, G, 3), do (B, G), dR (B, G, 4), dS (B, G, 3)."""
        clocks = [self.clock(time) for time in times]
        later = [clock for clock in clocks if clock > 0]
        changes = self._changes(mean, later) if later else ()
        if len(later) == len(clocks):
            return changes
        count = len(mean)
        still = tuple(mean.new_zeros(n) for n in ((count, 3), count, (count, 4), (count, 3)))
        moved = zip(*changes, strict=True)
        each = [next(moved) if clock > 0 else still for clock in clocks]
        return tuple(map(torch.stack, zip(*each, strict=True)))

    def _changes(self, mean: torch.Tensor, clocks: Sequence[float]) -> tuple[torch.Tensor, ...]:
        """The same at these moments of the box, 0-1, none of them the first."""
        where = self.inside(mean)
        if self.sheets:
            x = self.sheets.features(self.planes, where, clocks)
        else:
            x = torch.stack([features(self.planes, where, clock, self.layout) for clock in clocks])
        for weight in self.head[:-1]:
            # Not a ReLU: its slope at 0, where every feature starts, is 0, and nothing would ever move.
            x = torch.nn.functional.silu(torch.nn.functional.linear(x, weight))
        moved, opacity, turn, grow = torch.nn.functional.linear(x, self.head[-1]).split(OUTPUTS, -1)
        return moved * self.reach, opacity[..., 0], turn, grow

    def roughness(self) -> tuple[torch.Tensor, torch.Tensor]:
        """How far the planes are from smooth in space and in time, see `smoothness`."""
        return self.sheets.roughness(self.planes) if self.sheets else roughness(self.planes, self.layout)

    def on(self, device: torch.device) -> "Field":
        """The same on this device: its planes as sheets on a GPU, end to end on the CPU."""
        planes = self.sheets.unpack(self.planes) if self.sheets else self.planes
        head, planes = tuple(weight.to(device) for weight in self.head), planes.to(device)
        if device.type == "cpu":
            return replace(self, planes=planes, head=head, sheets=None, box=None)
        sheets, ends = Sheets(self.layout, planes), (self.low[:3], self.high[:3] - self.low[:3])
        # Brought there once: bringing numbers to a GPU waits for all that it still does.
        box = tuple(planes.new_tensor(a) for a in ends)
        return replace(self, planes=sheets.pack(planes), head=head, sheets=sheets, box=box)

    def inside(self, mean: torch.Tensor) -> torch.Tensor:
        """Positions in the box, 0-1."""
        low, size = self.box or (mean.new_tensor(a[:3]) for a in (self.low, self.high - self.low))
        return (mean - low) / size

    def clock(self, time: float) -> float:
        """Time in the box, 0-1."""
        return float((time - self.low[3]) / (self.high[3] - self.low[3]))

    @property
    def reach(self) -> float:
        """Half the longest side of the box [m]."""
        return float(np.max(self.high[:3] - self.low[:3]) / 2)


def still_field(
    low: np.ndarray,
    high: np.ndarray,
    sizes: np.ndarray,
    channels: int,
    width: int,
    rng: np.random.Generator,
    *,
    cubic: bool = False,
) -> Field:
    """A field that moves nothing yet: every plane is 1 and the head is random.

    low, high: the box (x, y, z [m], t [s]); sizes: knots along x, y, z, t at each scale, (L, 4); width: of the head's
    two hidden layers.
    """
    layout = Layout(np.asarray(sizes, np.int64), channels, cubic)
    widths = [layout.features, width, width, sum(OUTPUTS)]
    head = tuple(
        torch.tensor(rng.standard_normal((n, m)) * np.sqrt(1.0 / m), dtype=torch.float32) for m, n in pairwise(widths)
    )
    return Field(layout, np.asarray(low, float), np.asarray(high, float), torch.ones(layout.count), head)


def save_field(field: Field, moments: np.ndarray, tint: np.ndarray, history: np.ndarray) -> Deformation:
    """The field as an artifact; moments: those of the frames that were looked at [s], (M,); tint: what is added to the
    colours at each knot (K, G, 3); history: one row a report (R, 5)."""
    layout = {
        "planes": ["xy", "xz", "yz", "tx", "ty", "tz"],
        "sizes": field.layout.sizes.tolist(),
        "channels": field.layout.channels,
        "head": [list(w.shape) for w in field.head],
        "cubic": field.layout.cubic,
    }
    return Deformation(
        planes=field.planes.detach().numpy().astype(np.float32),
        weights=np.concatenate([w.detach().numpy().reshape(-1) for w in field.head]).astype(np.float32),
        layout=json.dumps(layout, sort_keys=True),
        low=field.low.astype(np.float32),
        high=field.high.astype(np.float32),
        moments=moments.astype(np.float32),
        tint=tint.astype(np.float16),
        history=np.asarray(history, np.float32).reshape(-1, 5),
    )


def load_field(deformation: Deformation) -> Field:
    """The field a reconstruction stored. Raises Problem if its layout and numbers do not fit."""
    told = json.loads(deformation.layout)
    layout = Layout(np.asarray(told["sizes"], np.int64), int(told["channels"]), bool(told.get("cubic", False)))
    ends = np.cumsum([0] + [int(np.prod(shape)) for shape in told["head"]])
    if layout.count != len(deformation.planes) or ends[-1] != len(deformation.weights):
        raise Problem(
            f"Deformation: its layout announces {layout.count} plane numbers and {ends[-1]} weights, and it holds "
            f"{len(deformation.planes)} and {len(deformation.weights)}. Run the reconstruction again."
        )
    head = tuple(
        torch.from_numpy(deformation.weights[a:b].reshape(shape).copy())
        for (a, b), shape in zip(pairwise(ends), told["head"], strict=True)
    )
    low, high = deformation.low.astype(float), deformation.high.astype(float)
    return Field(layout, low, high, torch.from_numpy(deformation.planes.copy()), head)


def displace(points: np.ndarray, field: Field, time: float) -> np.ndarray:
    """Where any points of the rest scene are at `time` [s]; camera frame [m], (..., 3)."""
    with torch.no_grad():
        flat = torch.tensor(np.asarray(points).reshape(-1, 3), dtype=torch.float32)
        return (flat + field(flat, time)[0]).numpy().reshape(np.shape(points))
