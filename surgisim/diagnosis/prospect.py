"""What a prediction is worth on frames that were never fitted.

With one covariance of noise and nuisances over the whole clip, the log likelihood of the later frames, given those
that were fitted, is that of all less that of the fitted ones:

    2 log p(held out | fitted) = const - (chi square of all frames - chi square of the fitted ones)

So a camera that drifts on, a point's constant, or a release whose moment nobody saw costs no prediction anything: what
the fitted frames and the prior allow is allowed.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from surgisim.diagnosis.metric import Metric, metric
from surgisim.diagnosis.noise import Whitener, whitener

DRAWS = 400
STRETCH = 5
"""Frames that are drawn together: what noise has left is alike over a few."""
SHOWS = 25.0
"""Chi square that an effect must take away in the frames held out, were it just as predicted, to be visible there:
2.5 standard deviations of what noise alone makes of such a gain, which are twice its root."""


@dataclass(frozen=True)
class Gain:
    """What one prediction gains over another, in chi square, with the 90 % interval of a bootstrap."""

    value: float
    low: float
    high: float
    expected: float
    """What it would gain on average, were it right and nothing else amiss."""

    @property
    def visible(self) -> bool:
        """Whether the frames can tell the two apart at all."""
        return self.expected > SHOWS

    @property
    def confirmed(self) -> bool:
        """Whether they speak for it, by more than the interval and by more than noise would."""
        return max(self.expected, self.value) > SHOWS and self.low > 0

    @property
    def refuted(self) -> bool:
        return self.visible and self.high < 0


@dataclass(frozen=True)
class Prospect:
    """Of a `Case`: the frames held out, seen from those that were fitted."""

    moved: np.ndarray
    """[m], (K, T, 3)."""
    until: int
    whiten: Whitener
    """Of the fitted frames."""
    space: Metric
    whiten_all: Whitener
    space_all: Metric
    seed: int

    @cached_property
    def draws(self) -> np.ndarray:
        """How often each part of `misfit` is drawn, (D, N)."""
        rng = np.random.default_rng([self.seed, 5])
        count = len(self.misfit(np.zeros_like(self.moved)))
        return rng.multinomial(count, np.full(count, 1 / count), DRAWS)

    def misfit(self, field: np.ndarray) -> np.ndarray:
        """Chi square of the frames held out, given the fitted ones: of each pattern over the points and stretch, (N,).

        field: a residual [m], (K, T, 3). Stretches, because what acts everywhere is one pattern's affair alone.
        """
        parts = self._parts(self.whiten_all(field), self.space_all)
        parts[:, : self.until] -= self._parts(self.whiten(field[:, : self.until]), self.space)
        return np.add.reduceat(parts, np.arange(0, parts.shape[1], STRETCH), axis=1).ravel()

    def gain(self, before: np.ndarray, after: np.ndarray) -> Gain:
        """Of one prediction over another [m], (K, T, 3)."""
        parts = self.misfit(self.moved - before) - self.misfit(self.moved - after)
        drawn = self.draws @ parts
        low, high = np.quantile(drawn, [0.05, 0.95])
        return Gain(float(parts.sum()), float(low), float(high), float(self.misfit(after - before).sum()))

    def _parts(self, white: np.ndarray, space: Metric) -> np.ndarray:
        """Of each pattern and frame, (M, T)."""
        cleared = space.cleared(white[:, None])[:, 0].astype(float)
        return (white * cleared).reshape(len(self.whiten.scale), -1, 3).sum(2)


def prospect(case) -> Prospect | None:
    """Of a `Case`; None where no frames are held out, or none of them shows a point."""
    clip = case.clip
    if clip.frames == clip.until or not clip.seen[:, clip.until :].any():
        return None
    whiten = whitener(case.noise, clip.rest, clip.seen, case.settings.offsets, clip.device)
    fixed = [whiten(g.columns).T.astype(np.float32) for g in case.groups]
    still = np.zeros((len(case.base.slopes), *clip.moved.shape))
    still[:, :, : clip.until] = case.base.slopes
    space = metric(np.concatenate([*fixed, whiten(still).T.astype(np.float32)], 1))
    return Prospect(clip.moved, clip.until, case.whiten, case.space, whiten, space, case.settings.seed)
