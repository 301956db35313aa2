"""All feature planes side by side, as a GPU reads and smooths them: a few large steps instead of many small ones.

    sheets (6 L, C, H, W): the space planes xy, xz, yz of every scale, then the time planes xt, yt, zt of every scale,
    each in the corner of a sheet that holds the largest of them

Numbers outside of a plane's corner count for nothing. See `planes` for the equations.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import torch
from torch.nn.functional import grid_sample, pad

from surgisim.deformation.lookup import shares
from surgisim.deformation.planes import SPACE, Layout

DOWN, ACROSS = [i for i, _ in SPACE], [j for _, j in SPACE]
"""Axes along a space plane's rows and columns."""
PLACES = 512
"""Places whose slopes are one product of matrices: a GPU works at many of them, and is slow at one long one."""


class Along(torch.autograd.Function):
    """Lines of W knots read at G places each: lines (S, W, K), places in knots (S, G) -> (S, G, K).

    Many places give their slopes back to few knots. Added one by one they would wait for each other; here they are the
    product of two matrices, the first of which says how much of each knot a place read.
    """

    @staticmethod
    def forward(ctx, lines, places):
        low = places.long()
        # A place at its line's last knot reads nothing of what lies beside it.
        high = (low + 1).clamp(max=lines.shape[1] - 1)
        share = places - low
        ctx.save_for_backward(lines, low, high, share)
        line = torch.arange(len(lines), device=lines.device)[:, None]
        return torch.lerp(lines[line, low], lines[line, high], share[..., None])

    @staticmethod
    def backward(ctx, slope):
        lines, low, high, share = ctx.saved_tensors
        to_lines = to_places = None
        if ctx.needs_input_grad[0]:
            blank = -low.shape[1] % PLACES
            read = slope.new_zeros(len(low), low.shape[1] + blank, lines.shape[1])
            read.scatter_(2, low[..., None], 1 - share[..., None]).scatter_add_(2, high[..., None], share[..., None])
            few, many = (a.unflatten(1, (-1, PLACES)) for a in (read, pad(slope, (0, 0, 0, blank))))
            to_lines = (few.mT @ many).sum(1)
        if ctx.needs_input_grad[1]:
            line = torch.arange(len(lines), device=lines.device)[:, None]
            to_places = (slope * (lines[line, high] - lines[line, low])).sum(-1)
        return to_lines, to_places


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
        share = 2 * (np.array(self.shapes[: self.spatial]) - 1) / (np.array(self.size) - 1)
        self.rows, self.columns = (self._put(share[:, k].reshape(-1, 3, 1)) for k in range(2))
        """How far a space plane reaches along the sheet, whose side is 2 long, (L, 3, 1) each."""
        self.steps = self._put(layout.sizes[:, :3, None] - 1)
        """From a line's first knot to its last, (L, 3, 1)."""
        self._rows: dict[float, torch.Tensor] = {}

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
        space = self._space(sheets[: self.spatial], at)
        # Each point lies there at those times and, beside that, at the start.
        times = [min(max(clock, 0.0), 1.0) for clock in clocks] + [0.0]
        moved = self._moved(sheets[self.spatial :], at, times)
        found = space.mT[:, :, None] * (moved[:, :, :-1] - moved[:, :, -1:])
        return found.permute(2, 1, 0, 3).flatten(2)

    def roughness(self, sheets: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """L_space and L_time, as `smoothness.roughness` of all planes end to end."""
        across, down, later = self._means
        space, time = sheets[: self.spatial], sheets[self.spatial :]
        rough = (sheets.diff(dim=-1).square() * across).sum() + (space.diff(dim=-2).square() * down).sum()
        return rough, (time.diff(n=2, dim=-2).square() * later).sum()

    def _space(self, sheets: torch.Tensor, at: torch.Tensor) -> torch.Tensor:
        """Product of each scale's three space planes, (L, C, G), at positions 0-1, (3, G)."""
        grid = torch.stack([at[ACROSS] * self.columns - 1, at[DOWN] * self.rows - 1], -1)
        found = grid_sample(sheets, grid.flatten(0, 1)[:, None], align_corners=True)[:, :, 0]
        first, second, third = found.unflatten(0, (-1, 3)).unbind(1)
        return first * second * third

    def _moved(self, sheets: torch.Tensor, at: torch.Tensor, times: Sequence[float]) -> torch.Tensor:
        """Product of each scale's three time planes, (L, G, T, C), at positions 0-1, (3, G), and T times, 0-1."""
        shares = torch.stack([self._rows_at(time) for time in times])
        lines = torch.einsum("sachw,tsh->sawtc", sheets.unflatten(0, (-1, 3)), shares)
        found = Along.apply(lines.flatten(0, 1).flatten(2), (at * self.steps).flatten(0, 1))
        first, second, third = found.unflatten(-1, (len(times), -1)).unflatten(0, (-1, 3)).unbind(1)
        return first * second * third

    def _rows_at(self, time: float) -> torch.Tensor:
        """How much of each row of knots a time plane's line at this time, 0-1, is made of, (L, H)."""
        if time not in self._rows:
            found = np.zeros((len(self.layout.sizes), self.size[0]))
            for share, n in zip(found, self.layout.sizes[:, 3], strict=True):
                share[:n] = shares(time, n, self.layout.cubic)
            # Kept: bringing them there waits for all that a GPU still does, and a clip has few moments.
            self._rows[time] = self._put(found)
        return self._rows[time]

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
