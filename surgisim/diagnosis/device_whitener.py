"""A whitener's products where the engine runs: by numpy on processors, by torch, which they do without, on a GPU."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from surgisim.mpm.stream import COMMANDS

if TYPE_CHECKING:
    import torch

    from surgisim.diagnosis.noise import Whitener


AT_ONCE = 128
"""Fields that lie on the device together."""
Array = Any
"""numpy's or torch's; what is done to them here both call the same."""


@dataclass(frozen=True)
class DeviceWhitener:
    """W = P L^-1 A^T and its transpose, but for each point's own scale and ways: to the noise's patterns (A), each of
    which is white in time but for its factor (L), less what a constant or an unseen sample could be (P)."""

    whiten: "Whitener"
    device: str
    """As torch calls it; numpy's is cpu."""
    kind: str = "float64"

    @cached_property
    def of(self) -> ModuleType:
        """numpy or torch."""
        return np if self.device == "cpu" else import_module("torch")

    @contextmanager
    def turn(self) -> Iterator[None]:
        """On a GPU, while no thread gives the engine's commands, which could be captured at the time."""
        if self.device.startswith("cpu"):
            yield
            return
        with COMMANDS, self.of.cuda.stream(self._stream):
            yield

    def on(self, array: np.ndarray) -> Array:
        """There, in the precision that is worked in."""
        if self.device == "cpu":
            return np.asarray(array, self.kind)
        there = self.of.as_tensor(np.ascontiguousarray(array), device=self.device)
        return there.to(getattr(self.of, self.kind))

    def off(self, array: Array) -> np.ndarray:
        return array if self.device == "cpu" else array.cpu().numpy()

    def of_fields(self, fields: np.ndarray) -> np.ndarray:
        """Of fields along each point's own axes [m], (..., K, T, 3), as (..., K T 3)."""
        count, size = (int(np.prod(shape)) for shape in (fields.shape[:-3], fields.shape[-3:]))
        flat, found = fields.reshape(count, *fields.shape[-3:]), np.empty((count, size), fields.dtype)
        for first in range(0, len(flat), AT_ONCE):
            some = slice(first, first + AT_ONCE)
            with self.turn():
                scaled = self.on(flat[some]) * self.scale[:, None] * self.mask[..., None]
                white = self.of.moveaxis(self.white(self.of.moveaxis(scaled, 0, 2)), 2, 0)
                found[some] = self.off(white.reshape(len(scaled), -1))
        return found.reshape(*fields.shape[:-3], size)

    def white(self, scaled: Array) -> Array:
        """(M, T, ...) of scaled displacements, (K, T, ...), zero where a sample is not seen."""
        count, frames = self.mask.shape
        modes = (self.axes.T @ scaled.reshape(count, -1)).reshape(count, frames, -1)
        white = self._stilled(self.inverse @ modes)
        if self.sure:
            return white.reshape(scaled.shape)
        flat = white.reshape(count * frames, -1)
        return (flat - self.lost @ (self.lost.T @ flat)).reshape(scaled.shape)

    def back(self, white: Array) -> Array:
        """The transpose, (K, T, D), of the noise's patterns that know nothing of unseen samples, (M, T, D)."""
        count, frames = self.mask.shape
        modes = self.inverse.swapaxes(1, 2) @ self._stilled(white)
        return (self.axes @ modes.reshape(count, -1)).reshape(count, frames, -1) * self.mask[..., None]

    @property
    def sure(self) -> bool:
        """Whether every sample was seen."""
        return not self.whiten.lost.shape[1]

    @cached_property
    def in_time(self) -> Array:
        """Every pattern's products of two frames, L^-T L^-1 less those of a constant, (M, T, T)."""
        still = (self.inverse.swapaxes(1, 2) @ self._still[:, :, None])[..., 0]
        return self.inverse.swapaxes(1, 2) @ self.inverse - still[:, :, None] * still[:, None]

    @cached_property
    def inverse(self) -> Array:
        return self.on(self.whiten.inverse)

    @cached_property
    def axes(self) -> Array:
        return self.on(self.whiten.axes)

    @cached_property
    def scale(self) -> Array:
        return self.on(self.whiten.scale)

    @cached_property
    def mask(self) -> Array:
        return self.on(self.whiten.mask)

    @cached_property
    def lost(self) -> Array:
        return self.on(self.whiten.lost)

    @cached_property
    def _still(self) -> Array:
        return self.on(self.whiten.still)

    @cached_property
    def _stream(self) -> "torch.cuda.Stream":
        return self.of.cuda.Stream(self.device)

    def _stilled(self, white: Array) -> Array:
        """Of patterns, (M, T, D), less what a constant of each point could be."""
        still = self._still[:, :, None]
        return white - still * (still.swapaxes(1, 2) @ white)
