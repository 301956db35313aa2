"""All feature planes side by side, as a GPU reads and smooths them: a few large steps instead of many small ones.

    sheets (6 L, C, H, W): the space planes xy, xz, yz of every scale, then the time planes xt, yt, zt of every scale,
    each in the corner of a sheet that holds the largest of them

Numbers outside of a plane's corner count for nothing. See `planes` for the equations.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import torch
from torch.nn.functional import grid_sample

from surgisim.deformation.planes import SPACE, Layout

DOWN, ACROSS = [i for i, _ in SPACE], [j for _, j in SPACE]
"""Axes along a space plane's rows and columns."""


class Sheets:
    """What holds for all sheets of a layout, on one device and in one float type."""

    def __init__(self, layout: Layout, like: torch.Tensor) -> None:
        self.layout, self.like = layout, like.detach()
        scales = range(len(layout.sizes))
        self.order = [(s, p) for s in scales for p in range(3)] + [(s, 3 + p) for s in scales for p in range(3)]
        self.shapes = [tuple(layout.plane(np.empty(layout.count), s, p).shape[:2]) for s, p in self.order]
        self.size = tuple(max(shape[k] for shape in self.shapes) for k in range(2))
        self.spatial = 3 * len(layout.sizes)
        """Sheets of space planes, which come first."""
        share = 2 * (np.array(self.shapes) - 1) / (np.array(self.size) - 1)
        self.rows, self.columns = (self._put(share[:, k].reshape(2, -1, 3, 1)) for k in range(2))
        """How far a plane reaches along the sheet, whose side is 2 long, (2, L, 3, 1) each."""

    def pack(self, flat: torch.Tensor) -> torch.Tensor:
        """The sheets, (6 L, C, H, W), of all planes end to end."""
        out = self.like.new_zeros(len(self.order), self.layout.channels, *self.size)
        for sheet, (scale, index), (h, w) in zip(out, self.order, self.shapes, strict=True):
            sheet[:, :h, :w] = self.layout.plane(flat, scale, index).permute(2, 0, 1)
        return out

    def unpack(self, sheets: torch.Tensor) -> torch.Tensor:
        """All planes end to end, of the sheets."""
        flat = sheets.new_empty(self.layout.count)
        for sheet, (scale, index), (h, w) in zip(sheets.detach(), self.order, self.shapes, strict=True):
            self.layout.plane(flat, scale, index).copy_(sheet[:, :h, :w].permute(1, 2, 0))
        return flat

    def features(self, sheets: torch.Tensor, where: torch.Tensor, clocks: Sequence[float]) -> torch.Tensor:
        """Feature of every point at each of B times, (B, G, L C), as `planes.features` of all planes end to end."""
        at = where.clamp(0, 1).T
        # Each point lies there at those times and, beside that, at the start.
        times = [min(max(clock, 0.0), 1.0) for clock in clocks] + [0.0]
        clock = torch.stack([torch.full_like(at, time) for time in times], -1).flatten(1)
        space = self._read(sheets[: self.spatial], at[DOWN], at[ACROSS], 0)
        moved = self._read(sheets[self.spatial :], clock, at.repeat_interleave(len(times), 1), 1)
        moved = moved.unflatten(-1, (-1, len(times)))
        found = space[..., None] * (moved[..., :-1] - moved[..., -1:])
        return found.permute(3, 2, 0, 1).flatten(2)

    def roughness(self, sheets: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """L_space and L_time, as `smoothness.roughness` of all planes end to end."""
        across, down, later = self._means
        space, time = sheets[: self.spatial], sheets[self.spatial :]
        rough = (sheets.diff(dim=-1).square() * across).sum() + (space.diff(dim=-2).square() * down).sum()
        return rough, (time.diff(n=2, dim=-2).square() * later).sum()

    def _read(self, sheets: torch.Tensor, down: torch.Tensor, across: torch.Tensor, kind: int) -> torch.Tensor:
        """Product of each scale's three planes, (L, C, N), at `down` and `across` of them, 0-1, (3, N) each."""
        grid = torch.stack([across * self.columns[kind] - 1, down * self.rows[kind] - 1], -1)
        found = grid_sample(sheets, grid.flatten(0, 1)[:, None], align_corners=True)[:, :, 0]
        first, second, third = found.unflatten(0, (-1, 3)).unbind(1)
        return first * second * third

    @cached_property
    def _means(self) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """What turns sums of squared differences across, down and, twice over, in time into means over the planes."""
        across, down, later = (np.zeros((len(self.order), 1, *self.size)) for _ in range(3))
        for k, (h, w) in enumerate(self.shapes):
            across[k, :, :h, : w - 1] = 1 / (h * (w - 1))
            down[k, :, : h - 1, :w] = 1 / ((h - 1) * w)
            later[k, :, : max(h - 2, 0), :w] = 1 / max((h - 2) * w, 1)
        cut = across[..., :-1], down[: self.spatial, :, :-1], later[self.spatial :, :, :-2]
        return tuple(self._put(a / self.layout.channels) for a in cut)

    def _put(self, array: np.ndarray) -> torch.Tensor:
        return torch.as_tensor(array, dtype=self.like.dtype, device=self.like.device)
