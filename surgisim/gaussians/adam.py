"""Adam in one pass over the numbers, for tensors whose rows come and go.

Kingma and Ba, Adam: a method for stochastic optimization, ICLR 2015.
"""

import math
from collections.abc import Iterable

import numpy as np
import torch
from numba import njit, prange

FIRST, SECOND, TINY = 0.9, 0.99, 1e-15
"""Decay of both moments, and what keeps the quotient finite. The second moment forgets fast because every step sees
another frame."""


class Adam:
    """Owns named tensors, their moments and their step sizes."""

    def __init__(self, tensors: dict[str, torch.Tensor], rates: dict[str, float]) -> None:
        self.tensors = {name: t.detach().clone().contiguous() for name, t in tensors.items()}
        self.rates = dict(rates)
        self._moments = {name: (torch.zeros_like(t), torch.zeros_like(t)) for name, t in self.tensors.items()}
        self._steps = dict.fromkeys(self.tensors, 0)

    def watch(self, names: Iterable[str]) -> None:
        """Ask for gradients of these tensors, and of no others; forget the last gradients."""
        wanted = set(names)
        for name, tensor in self.tensors.items():
            tensor.grad = None
            tensor.requires_grad_(name in wanted)

    def advance(self, factor: float) -> None:
        """One step of every watched tensor that has a gradient; factor: share of the step sizes to use."""
        there: list[tuple[torch.Tensor, ...]] = []
        rates: list[float] = []
        for name, tensor in self.tensors.items():
            if tensor.grad is None:
                continue
            self._steps[name] += 1
            n = self._steps[name]
            rate = self.rates[name] * factor * math.sqrt(1 - SECOND**n) / (1 - FIRST**n)
            flat = [a.detach().reshape(-1) for a in (tensor, *self._moments[name], tensor.grad)]
            if tensor.device.type == "cpu":
                _advance(*(a.numpy() for a in flat), rate)
            else:
                there.append(tuple(flat))
                rates.append(rate)
        if there:
            _advance_all(*map(list, zip(*there, strict=True)), rates)

    def choose_rows(self, names: Iterable[str], rows: torch.Tensor, fresh: torch.Tensor) -> None:
        """Keep or repeat these rows of these tensors; rows marked `fresh` start with no memory."""
        for name in names:
            self.tensors[name] = self.tensors[name].detach()[rows].contiguous()
            keep = (~fresh).reshape(-1, *[1] * (self.tensors[name].ndim - 1))
            self._moments[name] = tuple((m[rows] * keep).contiguous() for m in self._moments[name])


def _advance_all(
    value: list[torch.Tensor], first: list[torch.Tensor], second: list[torch.Tensor], slope: list[torch.Tensor],
    rates: list[float],
) -> None:  # fmt: skip
    """The same for all tensors at once, on any device."""
    torch._foreach_lerp_(first, slope, 1 - FIRST)
    torch._foreach_mul_(second, SECOND)
    torch._foreach_addcmul_(second, slope, slope, 1 - SECOND)
    size = torch._foreach_sqrt(second)
    torch._foreach_add_(size, TINY)
    torch._foreach_addcdiv_(value, first, size, [-rate for rate in rates])


@njit(cache=True, parallel=True, fastmath=True)
def _advance(value, first, second, slope, rate):
    for i in prange(len(value)):
        g = slope[i]
        first[i] = np.float32(FIRST) * first[i] + np.float32(1 - FIRST) * g
        second[i] = np.float32(SECOND) * second[i] + np.float32(1 - SECOND) * g * g
        value[i] -= np.float32(rate) * first[i] / (np.sqrt(second[i]) + np.float32(TINY))
