"""What a prediction is worth on frames that were never fitted.

With one covariance of noise and nuisances over the whole clip, the log likelihood of the later frames, given those
that were fitted, is that of all less that of the fitted ones:

    2 log p(held out | fitted) = const - (chi square of all frames - chi square of the fitted ones)

So a camera that drifts on, a point's constant, or a release whose moment nobody saw costs no prediction anything: what
the fitted frames and the prior allow is allowed. So is what a prediction's own numbers may be after the fit, the base's
and the law's strength: directions W of the frames held out, each at one standard deviation (`Foretold.ways`), which
give chi square a(1 + W^T W)^-1 a in return, a = <W, residual>, and cost log det(1 + W^T W).
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
class Foretold:
    """A prediction of the whole clip."""

    moved: np.ndarray
    """[m], (K, T, 3)."""
    ways: np.ndarray
    """How it moves with its numbers, independent ones, each by a standard deviation of what the fitted frames leave
    open [m], (C, K, T, 3); nothing in those."""


@dataclass(frozen=True)
class Gain:
    """What one prediction gains over another, in twice the log likelihood, with the 90 % interval of a bootstrap."""

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

    def misfit(self, field: np.ndarray, ways: np.ndarray | None = None) -> np.ndarray:
        """Minus twice the log likelihood of the frames held out, given the fitted ones, less what noise alone costs:
        of each pattern over the points and stretch, (N,).

        field: a residual [m], (K, T, 3); ways: as a `Foretold` has them. Stretches, because what acts everywhere is
        one pattern's affair alone.
        """
        white, price = self.whiten_all(field), 0.0
        if ways is not None and len(ways):
            open_to = self.whiten_all(ways).T
            told = np.eye(len(ways)) + self.space_all.gram(open_to, open_to)
            likely = np.linalg.solve(told, self.space_all.gram(open_to, white[:, None])[:, 0])
            white = white - open_to @ likely
            price = float(likely @ likely + np.linalg.slogdet(told)[1])
        parts = self._parts(white, self.space_all)
        parts[:, : self.until] -= self._parts(self.whiten(field[:, : self.until]), self.space)
        found = np.add.reduceat(parts, np.arange(0, parts.shape[1], STRETCH), axis=1).ravel()
        return found + price / len(found)

    def gain(self, before: Foretold, after: Foretold) -> Gain:
        """Of one prediction over another."""
        parts = self.misfit(self.moved - before.moved, before.ways) - self.misfit(self.moved - after.moved, after.ways)
        drawn = self.draws @ parts
        low, high = np.quantile(drawn, [0.05, 0.95])
        nothing = np.zeros_like(before.moved)
        right = self.misfit(after.moved - before.moved, before.ways) - self.misfit(nothing, after.ways)
        return Gain(float(parts.sum()), float(low), float(high), float(right.sum()))

    def _parts(self, white: np.ndarray, space: Metric) -> np.ndarray:
        """Of each pattern and frame, (M, T)."""
        return (white * space.cleared(white)).reshape(len(self.whiten.scale), -1, 3).sum(2)


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
