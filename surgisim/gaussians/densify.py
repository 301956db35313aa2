"""Gaussians come and go: those that show nothing are dropped, those that blur an edge are split.

Kerbl, Kopanas, Leimkuehler and Drettakis, 3D Gaussian splatting, 2023, section 5; here with a bound on their number.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import torch

from surgisim.gaussians.adam import Adam

ATTRIBUTES = ("mean", "opacity", "scale", "rotation", "color")
FAINT = 0.02
"""Opacity below which a Gaussian is dropped [1]."""
SHRINK = 1.6
"""A split Gaussian's parts have its radii over this."""


@dataclass
class Record:
    """What the Gaussians did since the last look."""

    pull: torch.Tensor
    """Sum of the projected centres' gradient lengths [1/px], (G,)."""
    shown: torch.Tensor
    """Largest sum of weights in any image [px], (G,)."""

    @classmethod
    def empty(cls, count: int, device: torch.device | str = "cpu") -> "Record":
        return cls(torch.zeros(count, device=device), torch.zeros(count, device=device))

    def add(self, pull: torch.Tensor, shown: torch.Tensor) -> None:
        """Take in B images: the projected centres' gradients [1/px], (B, G, 2), and weights [px], (B, G)."""
        self.pull += pull.norm(dim=-1).sum(0)
        self.shown = torch.maximum(self.shown, shown.amax(0))


def renew(adam: Adam, record: Record, most: int, share: float, widest: float, beside: Sequence[str] = ()) -> int:
    """Drop and split in place; returns the new count.

    most: bound on the count; share: largest share of the Gaussians to split; widest: largest radius kept [m]; beside:
    what has a row for each Gaussian beside its attributes.
    """
    opacity = torch.sigmoid(adam.tensors["opacity"].detach())
    radius = adam.tensors["scale"].detach().amax(1).exp()
    keep = (opacity > FAINT) & (radius < widest) & (record.shown > 0.05)
    rows = keep.nonzero()[:, 0]
    room = max(min(most - len(rows), int(share * len(rows))), 0)
    worst = torch.argsort(record.pull[rows], descending=True, stable=True)[:room]
    split = torch.zeros(len(rows), dtype=torch.bool, device=rows.device)
    split[worst] = True
    twice = torch.cat([rows, rows[split]])
    fresh = torch.cat([split, torch.ones(int(split.sum()), dtype=torch.bool, device=rows.device)])
    adam.choose_rows((*ATTRIBUTES, *beside), twice, fresh)
    _part(adam, fresh, len(rows))
    return len(twice)


def _part(adam: Adam, fresh: torch.Tensor, first: int) -> None:
    """Move the two parts of each split Gaussian apart along its longest axis and shrink them."""
    mean, scale, rotation = (adam.tensors[name] for name in ("mean", "scale", "rotation"))
    axis = scale[fresh].argmax(1)
    along = _axes(rotation[fresh])[torch.arange(len(axis), device=axis.device), :, axis]
    offset = along * scale[fresh].amax(1, keepdim=True).exp() * 0.5
    side = torch.where(fresh.nonzero()[:, 0] < first, 1.0, -1.0)[:, None]
    mean[fresh] += side * offset
    scale[fresh] -= math.log(SHRINK)


def _axes(q: torch.Tensor) -> torch.Tensor:
    """Rotation matrices of quaternions w, x, y, z, (N, 3, 3)."""
    w, x, y, z = (q / q.norm(dim=1, keepdim=True)).unbind(1)
    rows = [
        torch.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], 1),
        torch.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], 1),
        torch.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], 1),
    ]
    return torch.stack(rows, 1)
