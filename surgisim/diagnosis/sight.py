"""Products of what points would do with each other, and with what is left to explain, beside noise and nuisances.

Columns of the tangent are few fields in space with courses in time (answers.py). With W the whitening, U the nuisances'
whitened columns, r a residual and S = W A such columns, what is wanted is S^T S, U^T S and r^T S. The last two are
(W^T U)^T A and (W^T r)^T A, where W^T U is made once for all that is tried. The first is a sum over the noise's
patterns m of A_m^T P_m A_m with P_m, (T, T), made once too. So a place costs a few products of its fields, not of its
columns. All in double precision, since nuisances may take a column all but wholly, and where the engine runs.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import torch

from surgisim.diagnosis.answers import Answers
from surgisim.diagnosis.device_whitener import DeviceWhitener
from surgisim.diagnosis.metric import Metric
from surgisim.diagnosis.noise import Whitener
from surgisim.recordings.ways import turned

SIDE_BY_SIDE = 16
"""Patterns, or columns, whose products are held at once."""


class Products(NamedTuple):
    plain: np.ndarray
    """Mean product of the displacements at a sample that is seen [m^2], (C, C)."""
    gram: np.ndarray
    """Under the metric [1], (C, C)."""
    shadow: np.ndarray
    """With the residuals, under the metric [1], (C, D)."""


@dataclass(frozen=True)
class Left:
    """Residuals that a metric has cleared."""

    cleared: torch.Tensor
    """(N, D)"""
    back: torch.Tensor
    """W^T of them, (T, 3 K, D)."""


@dataclass(frozen=True)
class Sight:
    whiten: Whitener
    space: Metric
    seen: np.ndarray
    """(K, T)"""
    device: str = "cpu"

    def of(self, vectors: np.ndarray) -> Left:
        """Whitened residuals, (N, D), cleared of nuisances."""
        cleared = self.space.cleared(vectors)
        with self._white.turn():
            there = self._white.on(cleared)
            return Left(there, self._back(there))

    def products(self, columns: np.ndarray | Answers, left: Left) -> Products:
        """Of displacements [m], (C, K, T, 3)."""
        products = self._of_answers if isinstance(columns, Answers) else self._of_columns
        with self._white.turn():
            return Products(*(one.cpu().numpy() for one in products(columns, left)))

    def _of_columns(self, columns: np.ndarray, left: Left) -> tuple[torch.Tensor, ...]:
        there = self._white
        fields = there.on(columns)
        plain = torch.einsum("ckti,dkti->cd", fields * self._seen[:, :, None], fields)
        scaled = there.on(turned(columns, self.whiten.ways)) * there.scale[:, None] * there.mask[..., None]
        white = self._side_by_side(scaled.permute(1, 2, 0, 3))
        gram = self._beside_nuisances(white.T @ white, white.T @ self._columns)
        return plain / self._seen.sum(), gram, white.T @ left.cleared

    def _of_answers(self, answers: Answers, left: Left) -> tuple[torch.Tensor, ...]:
        there = self._white
        count, causes, frames = answers.courses.shape
        courses = there.on(answers.courses).swapaxes(1, 2).reshape(count, -1)
        share, states = there.on(answers.share), answers.states.swapaxes(1, 2)
        fields = torch.einsum("ts,qksi->tqki", share, there.on(states))
        known = fields * self._seen.T[:, None, :, None]
        plain = _over_time(courses, known.flatten(2) @ fields.flatten(2).swapaxes(1, 2))
        scaled = torch.einsum("ts,qksi->tqki", share, there.on(turned(states, self.whiten.ways)))
        scaled = scaled * there.scale * there.mask.T[:, None, :, None]
        mine, shadow = (
            courses @ (scaled.flatten(2) @ back).reshape(frames * causes, -1) for back in (self._nuisances, left.back)
        )
        # Pairs of frames are the cheaper the fewer causes there are, columns the fewer of them.
        by_pairs = 4 * frames * causes**2 < count * (frames + count)
        own = self._by_pairs(courses, scaled) if by_pairs else self._by_columns(courses, scaled)
        return plain / self._seen.sum(), self._beside_nuisances(own, mine), shadow

    def _by_pairs(self, courses: torch.Tensor, scaled: torch.Tensor) -> torch.Tensor:
        """S^T S by products of fields at all pairs of frames."""
        there, (frames, causes, count, _) = self._white, scaled.shape
        modes = (there.axes.T @ scaled.permute(2, 0, 1, 3).reshape(count, -1)).reshape(count, frames * causes, 3)
        total = torch.zeros((frames, causes, frames, causes), dtype=modes.dtype, device=modes.device)
        for first in range(0, count, SIDE_BY_SIDE):
            some = slice(first, first + SIDE_BY_SIDE)
            pairs = (modes[some] @ modes[some].swapaxes(1, 2)).reshape(-1, *total.shape)
            total += (pairs * there.in_time[some][:, :, None, :, None]).sum(0)
        own = courses @ total.reshape(frames * causes, -1) @ courses.T
        if there.sure:
            return own
        taken = scaled.swapaxes(2, 3).reshape(frames, causes * 3, count) @ self._unseen
        taken = courses @ taken.reshape(frames * causes, -1)
        return own - taken @ taken.T

    def _by_columns(self, courses: torch.Tensor, scaled: torch.Tensor) -> torch.Tensor:
        """S^T S by the columns."""
        frames, causes = scaled.shape[:2]
        white = self._side_by_side(torch.einsum("ctq,tqki->ktci", courses.reshape(-1, frames, causes), scaled))
        return white.T @ white

    def _side_by_side(self, scaled: torch.Tensor) -> torch.Tensor:
        """Whitened columns, (N, C), of scaled displacements at seen samples, (K, T, C, 3)."""
        return self._white.white(scaled).swapaxes(2, 3).reshape(-1, scaled.shape[2])

    def _beside_nuisances(self, own: torch.Tensor, mine: torch.Tensor) -> torch.Tensor:
        """Products S^T S, (C, C), less what nuisances take by S^T U, (C, M)."""
        part = torch.linalg.solve_triangular(self._factor, mine.T, upper=False)
        return own - part.T @ part

    def _back(self, white: torch.Tensor) -> torch.Tensor:
        """W^T, but for scale and ways, of whitened vectors (N, D) that know nothing of unseen samples, (T, 3 K, D)."""
        count, frames = self._white.mask.shape
        found = torch.empty((frames, 3 * count, white.shape[1]), dtype=white.dtype, device=white.device)
        for first in range(0, white.shape[1], SIDE_BY_SIDE):
            some = slice(first, first + SIDE_BY_SIDE)
            field = self._white.back(white[:, some].reshape(count, frames, -1)).reshape(count, frames, 3, -1)
            found[:, :, some] = field.permute(1, 0, 2, 3).reshape(frames, 3 * count, -1)
        return found

    @cached_property
    def _white(self) -> DeviceWhitener:
        return DeviceWhitener(self.whiten, self.device)

    @cached_property
    def _columns(self) -> torch.Tensor:
        """U, (N, M)."""
        return self._white.on(self.space.columns)

    @cached_property
    def _factor(self) -> torch.Tensor:
        """Lower Cholesky factor of 1 + U^T U."""
        gram = self._columns.T @ self._columns
        return torch.linalg.cholesky(gram + torch.eye(len(gram), dtype=gram.dtype, device=gram.device))

    @cached_property
    def _nuisances(self) -> torch.Tensor:
        """W^T U, (T, 3 K, M)."""
        return self._back(self._columns)

    @cached_property
    def _unseen(self) -> torch.Tensor:
        """W^T of what samples that are not seen become, of one axis, (T, K, L)."""
        lost = self._white.lost.reshape(*self._white.mask.shape, -1)
        return self._white.back(lost).swapaxes(0, 1).contiguous()

    @cached_property
    def _seen(self) -> torch.Tensor:
        return self._white.on(self.seen)


def _over_time(courses: torch.Tensor, pairs: torch.Tensor) -> torch.Tensor:
    """Sum over frames of products of fields, (T, Q, Q), with courses, (C, T Q), (C, C)."""
    frames, causes, _ = pairs.shape
    half = torch.einsum("ctq,tqr->ctr", courses.reshape(-1, frames, causes), pairs)
    return half.flatten(1) @ courses.T
