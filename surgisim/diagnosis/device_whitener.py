"""A whitener's products as tensors, on the device that the engine runs on."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import torch

from surgisim.mpm.stream import COMMANDS

if TYPE_CHECKING:
    from surgisim.diagnosis.noise import Whitener


AT_ONCE = 128
"""Fields that lie on the device together."""


@dataclass(frozen=True)
class DeviceWhitener:
    """W = P L^-1 A^T and its transpose, but for each point's own scale and ways: to the noise's patterns (A), each of
    which is white in time but for its factor (L), less what a constant or an unseen sample could be (P)."""

    whiten: "Whitener"
    device: str
    kind: torch.dtype = torch.float64

    @contextmanager
    def turn(self) -> Iterator[None]:
        """On a GPU, while no thread gives the engine's commands, which could be captured at the time."""
        if self.device == "cpu":
            yield
            return
        with COMMANDS, torch.cuda.stream(self._stream):
            yield

    def on(self, array: np.ndarray) -> torch.Tensor:
        return torch.as_tensor(np.ascontiguousarray(array), device=self.device).to(self.kind)

    def of_fields(self, fields: np.ndarray) -> np.ndarray:
        """Of fields along each point's own axes [m], (..., K, T, 3), as (..., K T 3)."""
        flat = fields.reshape(-1, *fields.shape[-3:])
        found = np.empty((len(flat), flat[0].size), fields.dtype)
        for first in range(0, len(flat), AT_ONCE):
            some = slice(first, first + AT_ONCE)
            with self.turn():
                scaled = self.on(flat[some]) * self.scale[:, None] * self.mask[..., None]
                white = self.white(scaled.permute(1, 2, 0, 3)).permute(2, 0, 1, 3)
                found[some] = white.reshape(len(scaled), -1).cpu().numpy()
        return found.reshape(*fields.shape[:-3], -1)

    def white(self, scaled: torch.Tensor) -> torch.Tensor:
        """(M, T, ...) of scaled displacements, (K, T, ...), zero where a sample is not seen."""
        count, frames = self.mask.shape
        modes = (self.axes.T @ scaled.reshape(count, -1)).reshape(count, frames, -1)
        white = self._stilled(self.inverse @ modes)
        if self.sure:
            return white.reshape(scaled.shape)
        flat = white.reshape(count * frames, -1)
        return (flat - self.lost @ (self.lost.T @ flat)).reshape(scaled.shape)

    def back(self, white: torch.Tensor) -> torch.Tensor:
        """The transpose, (K, T, D), of the noise's patterns that know nothing of unseen samples, (M, T, D)."""
        count, frames = self.mask.shape
        modes = self.inverse.swapaxes(1, 2) @ self._stilled(white)
        return (self.axes @ modes.reshape(count, -1)).reshape(count, frames, -1) * self.mask[..., None]

    @property
    def sure(self) -> bool:
        """Whether every sample was seen."""
        return not self.whiten.lost.shape[1]

    @cached_property
    def in_time(self) -> torch.Tensor:
        """Every pattern's products of two frames, L^-T L^-1 less those of a constant, (M, T, T)."""
        still = (self.inverse.swapaxes(1, 2) @ self._still[:, :, None])[..., 0]
        return self.inverse.swapaxes(1, 2) @ self.inverse - still[:, :, None] * still[:, None]

    @cached_property
    def inverse(self) -> torch.Tensor:
        return self.on(self.whiten.inverse)

    @cached_property
    def axes(self) -> torch.Tensor:
        return self.on(self.whiten.axes)

    @cached_property
    def scale(self) -> torch.Tensor:
        return self.on(self.whiten.scale)

    @cached_property
    def mask(self) -> torch.Tensor:
        return self.on(self.whiten.mask)

    @cached_property
    def lost(self) -> torch.Tensor:
        return self.on(self.whiten.lost)

    @cached_property
    def _still(self) -> torch.Tensor:
        return self.on(self.whiten.still)

    @cached_property
    def _stream(self) -> torch.cuda.Stream:
        return torch.cuda.Stream(self.device)

    def _stilled(self, white: torch.Tensor) -> torch.Tensor:
        """Of patterns, (M, T, D), less what a constant of each point could be."""
        still = self._still[:, :, None]
        return white - still * (still.swapaxes(1, 2) @ white)
