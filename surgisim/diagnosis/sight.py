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
from scipy.linalg import solve_triangular

from surgisim.diagnosis.answers import Answers
from surgisim.diagnosis.device_whitener import Array, DeviceWhitener
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

    cleared: Array
    """(N, D)"""
    back: Array
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
            return Products(*(self._white.off(one) for one in products(columns, left)))

    def _of_columns(self, columns: np.ndarray, left: Left) -> tuple[Array, ...]:
        there = self._white
        fields = there.on(columns)
        plain = (fields * self._seen[:, :, None]).reshape(len(fields), -1) @ fields.reshape(len(fields), -1).T
        scaled = there.on(turned(columns, self.whiten.ways)) * there.scale[:, None] * there.mask[..., None]
        white = self._side_by_side(there.of.moveaxis(scaled, 0, 2))
        gram = self._beside_nuisances(white.T @ white, white.T @ self._columns)
        return plain / self._seen.sum(), gram, white.T @ left.cleared

    def _of_answers(self, answers: Answers, left: Left) -> tuple[Array, ...]:
        there = self._white
        count, causes, frames = answers.courses.shape
        courses = there.on(answers.courses).swapaxes(1, 2).reshape(count, -1)
        share, states = there.on(answers.share), answers.states.swapaxes(1, 2)
        fields = there.of.tensordot(share, there.on(states), ([1], [2]))
        flat, known = (one.reshape(frames, causes, -1) for one in (fields, fields * self._seen.T[:, None, :, None]))
        plain = self._over_time(courses, known @ flat.swapaxes(1, 2))
        scaled = there.of.tensordot(share, there.on(turned(states, self.whiten.ways)), ([1], [2]))
        scaled = scaled * there.scale * there.mask.T[:, None, :, None]
        flat = scaled.reshape(frames, causes, -1)
        mine, shadow = (courses @ (flat @ back).reshape(frames * causes, -1) for back in (self._nuisances, left.back))
        # Pairs of frames are the cheaper the fewer causes there are, columns the fewer of them.
        by_pairs = 4 * frames * causes**2 < count * (frames + count)
        own = self._by_pairs(courses, scaled) if by_pairs else self._by_columns(courses, scaled)
        return plain / self._seen.sum(), self._beside_nuisances(own, mine), shadow

    def _by_pairs(self, courses: Array, scaled: Array) -> Array:
        """S^T S by products of fields at all pairs of frames."""
        there, (frames, causes, count, _) = self._white, scaled.shape
        modes = there.axes.T @ there.of.moveaxis(scaled, 2, 0).reshape(count, -1)
        modes, total = modes.reshape(count, frames * causes, 3), 0.0
        for first in range(0, count, SIDE_BY_SIDE):
            some = slice(first, first + SIDE_BY_SIDE)
            pairs = (modes[some] @ modes[some].swapaxes(1, 2)).reshape(-1, frames, causes, frames, causes)
            total = total + (pairs * there.in_time[some][:, :, None, :, None]).sum(0)
        own = courses @ total.reshape(frames * causes, -1) @ courses.T
        if there.sure:
            return own
        taken = scaled.swapaxes(2, 3).reshape(frames, causes * 3, count) @ self._unseen
        taken = courses @ taken.reshape(frames * causes, -1)
        return own - taken @ taken.T

    def _by_columns(self, courses: Array, scaled: Array) -> Array:
        """S^T S by the columns."""
        frames, causes, count, _ = scaled.shape
        move = self._white.of.moveaxis
        columns = move(courses.reshape(-1, frames, causes), 1, 0) @ scaled.reshape(frames, causes, -1)
        white = self._side_by_side(move(columns.reshape(frames, -1, count, 3), 2, 0))
        return white.T @ white

    def _side_by_side(self, scaled: Array) -> Array:
        """Whitened columns, (N, C), of scaled displacements at seen samples, (K, T, C, 3)."""
        return self._white.white(scaled).swapaxes(2, 3).reshape(-1, scaled.shape[2])

    def _beside_nuisances(self, own: Array, mine: Array) -> Array:
        """Products S^T S, (C, C), less what nuisances take by S^T U, (C, M)."""
        part = self._standing @ mine.T
        return own - part.T @ part

    def _back(self, white: Array) -> Array:
        """W^T, but for scale and ways, of whitened vectors (N, D) that know nothing of unseen samples, (T, 3 K, D)."""
        count, frames = self._white.mask.shape
        found, move = [], self._white.of.moveaxis
        for first in range(0, white.shape[1], SIDE_BY_SIDE):
            some = white[:, first : first + SIDE_BY_SIDE].reshape(count, frames, -1)
            field = self._white.back(some).reshape(count, frames, 3, -1)
            found.append(move(field, 1, 0).reshape(frames, 3 * count, -1))
        return self._white.of.concatenate(found, 2)

    @cached_property
    def _white(self) -> DeviceWhitener:
        return DeviceWhitener(self.whiten, self.device)

    @cached_property
    def _columns(self) -> Array:
        """U, (N, M)."""
        return self._white.on(self.space.columns)

    @cached_property
    def _standing(self) -> Array:
        """L^-1 of the lower Cholesky factor of 1 + U^T U, (M, M)."""
        return self._white.on(solve_triangular(self.space.factor[0], np.eye(len(self.space.own)), trans=1))

    @cached_property
    def _nuisances(self) -> Array:
        """W^T U, (T, 3 K, M)."""
        return self._back(self._columns)

    @cached_property
    def _unseen(self) -> Array:
        """W^T of what samples that are not seen become, of one axis, (T, K, L)."""
        lost = self._white.lost.reshape(*self._white.mask.shape, -1)
        return self._white.back(lost).swapaxes(0, 1)

    @cached_property
    def _seen(self) -> Array:
        return self._white.on(self.seen)

    def _over_time(self, courses: Array, pairs: Array) -> Array:
        """Sum over frames of products of fields, (T, Q, Q), with courses, (C, T Q), (C, C)."""
        frames, causes, _ = pairs.shape
        move = self._white.of.moveaxis
        half = move(move(courses.reshape(-1, frames, causes), 1, 0) @ pairs, 1, 0)
        return half.reshape(len(courses), -1) @ courses.T
