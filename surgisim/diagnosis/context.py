"""What all steps of a diagnosis share."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis import calibration, nuisance
from surgisim.diagnosis.base import Base
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.foretold import ByBase
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.metric import Metric, metric
from surgisim.diagnosis.noise import Noise, Whitener
from surgisim.diagnosis.nuisance import Group, positions, release, span
from surgisim.diagnosis.perceived import OF_TRACKS
from surgisim.diagnosis.prospect import Prospect, prospect
from surgisim.diagnosis.saturated import Saturated, SmoothFit, saturated
from surgisim.diagnosis.sight import Sight

LAW = 100.0
"""Length of a law's whitened response at one standard deviation of its strength, where it is weighed beside a drift."""
ON_A_GPU = 8
"""Runs side by side there: their steps take hardly longer than one's."""


@dataclass(frozen=True)
class Case:
    """One recording with its noise, its base and everything that is no physics."""

    clip: Clip
    settings: Diagnosing
    noise: Noise
    whiten: Whitener
    base: Base
    space: Metric
    memo: Memo
    z: np.ndarray
    """Whitened residual of the base, (N,)."""
    nulls: np.ndarray
    """(N, D)"""
    slopes: slice
    """Where the base's own columns stand in the metric, after those of the groups."""
    groups: list[Group]
    """What a residual may hold beside physics, over the whole clip."""
    drift: np.ndarray
    """How far the parts of the camera's drift go over the clip [m], (3,)."""
    drift_at_rest: np.ndarray
    """The same as the rest before the first grasp tells it [m], (3,)."""
    behind: float = 0.0
    """By how much the base alone is less likely with this drift than with the one that suits it best [log evidence].
    Every law found here owes as much: without it, the camera would have been said to drift."""

    def drifting(self, sizes: np.ndarray) -> "Case":
        """The same where the camera drifts so far over the clip [m], (3,)."""
        first, second = (self.likelihood(s) for s in (self.likeliest_drift(), sizes))
        return replace(
            self.open_by("drift", nuisance.by_part(sizes / self.drift)), drift=sizes, behind=max(first - second, 0.0)
        )

    def likelihood(self, sizes: np.ndarray, law: np.ndarray | None = None) -> float:
        """log of the fitted frames' likelihood, times the prior, beside a drift of these sizes [m], (3,), but for a
        constant; beside a law of open strength too, whose whitened response is `law`, (N,)."""
        gram, shadow = self._seen_beside(law)
        wide = np.ones(len(shadow))
        wide[nuisance.span(self.groups, "drift")] = nuisance.by_part(sizes / self.drift)
        return nuisance.likelihood(gram, shadow, wide) + float(nuisance.drift_prior(sizes).sum())

    def likeliest_drift(self, law: np.ndarray | None = None) -> np.ndarray:
        """Sizes of the drift's parts [m], (3,), of largest `likelihood`."""
        sizes = np.full(len(nuisance.PARTS), nuisance.DRIFT)
        for _ in range(nuisance.ASCENTS):
            for part in range(len(sizes)):
                tries = np.tile(sizes, (len(nuisance.DRIFTS), 1))
                tries[:, part] = nuisance.DRIFTS
                sizes = max(tries, key=lambda tried: self.likelihood(tried, law))
        return sizes

    def _seen_beside(self, law: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Products of the metric's columns, and a law's, with each other and with the residual."""
        gram, shadow = self._products
        if law is None:
            return gram, shadow
        # Its strength is as open as a direction of the metric that takes this much chi square.
        unit = LAW / max(np.linalg.norm(law), 1e-30) * law
        aside = self.space.seen_through(unit)
        gram = np.block([[gram, aside[:, None]], [aside[None], np.array([[unit @ unit]])]])
        return gram, np.append(shadow, unit @ self.z)

    @cached_property
    def _products(self) -> tuple[np.ndarray, np.ndarray]:
        return self.space.own, self.space.seen_through(self.z)

    def open_by(self, name: str, times: float | np.ndarray) -> "Case":
        """The same with the prior of one kind of nuisance some times as wide, or of each of its directions, (C,)."""
        columns = self.space.columns.copy()
        columns[:, span(self.groups, name)] *= times
        groups = [g.wider(times) if g.name == name else g for g in self.groups]
        space = metric(columns)
        return replace(self, space=space, groups=groups, nulls=nulls(space, self.whiten, self.settings))

    @property
    def misfit(self) -> float:
        """Chi square of the base beside everything that is no physics."""
        return float(self.space.gram(self.z[:, None], self.z[:, None])[0, 0])

    @cached_property
    def beside_base(self) -> Metric:
        """What a residual may hold beside a base whose numbers and moments of release the engine searches."""
        searched = positions(self.groups, {release(*each) for each in self.clip.releases()})
        return metric(np.delete(self.space.columns, [*range(*self.slopes.indices(10**9)), *searched], axis=1))

    @cached_property
    def sight(self) -> Sight:
        """What hypotheses are weighed by."""
        return Sight(self.whiten, self.space, self.clip.seen[:, : self.clip.until], self.clip.device)

    @cached_property
    def saturated(self) -> Saturated:
        """What any smooth residual could gain."""
        return saturated(self.clip, self.whiten, self.space, self.nulls)

    @cached_property
    def smooth(self) -> SmoothFit:
        """What it gains on the base's residual."""
        return self.saturated.fit(self.z)

    @cached_property
    def nuisance_ratio(self) -> float:
        """Squares of the nuisances at their most likely values, over what all but 5 % of the nulls stay below [1].

        That a track is lost says nothing of the tissue.
        """
        counted = np.ones(self.space.columns.shape[1], bool)
        for name in OF_TRACKS:
            counted[span(self.groups, name)] = False
        own, nulls = (self.space.likely(v)[counted] for v in (self.z, self.nulls))
        return float((own**2).sum() / np.quantile((nulls**2).sum(0), 0.95))

    @cached_property
    def prospect(self) -> Prospect | None:
        """What frames held out say of a prediction; None where there are none."""
        return prospect(self)

    @cached_property
    def by_base(self) -> ByBase:
        """What the base's numbers do in frames held out."""
        return ByBase(self)

    @property
    def overstretched(self) -> bool:
        """Whether camera, grips, base and the simulator's own error would have to be larger than they ever are."""
        return self.settings.calibrated and self.nuisance_ratio > calibration.OVERSTRETCHED

    @property
    def workers(self) -> int:
        """Runs side by side."""
        return workers(self.clip, self.settings)


def nulls(space: Metric, whiten: Whitener, settings: Diagnosing) -> np.ndarray:
    """Whitened residuals of nothing but noise and nuisances, (N, D)."""
    return space.draw(np.random.default_rng(settings.seed), settings.nulls, whiten.known)


def workers(clip: Clip, settings: Diagnosing) -> int:
    """Runs side by side."""
    return settings.workers if clip.device == "cpu" else ON_A_GPU
