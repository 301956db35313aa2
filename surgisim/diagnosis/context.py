"""What all steps of a diagnosis share."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis import calibration
from surgisim.diagnosis.base import Base
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.metric import Metric, metric
from surgisim.diagnosis.noise import Noise, Whitener
from surgisim.diagnosis.nuisance import Group, positions, release, span
from surgisim.diagnosis.prospect import Prospect, prospect
from surgisim.diagnosis.saturated import Saturated, SmoothFit, saturated

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
    drift: float
    """How far the camera drifts over the clip, as its rest shows [m]."""

    def drifting(self, size: float) -> "Case":
        """The same where the camera drifts so far over the clip [m]."""
        return replace(self.open_by("drift", size / self.drift), drift=size)

    def open_by(self, name: str, times: float) -> "Case":
        """The same with the prior of one kind of nuisance some times as wide."""
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
    def saturated(self) -> Saturated:
        """What any smooth residual could gain."""
        return saturated(self.clip, self.whiten, self.space, self.nulls)

    @cached_property
    def smooth(self) -> SmoothFit:
        """What it gains on the base's residual."""
        return self.saturated.fit(self.z)

    @cached_property
    def nuisance_ratio(self) -> float:
        """Squares of the nuisances at their most likely values, over what all but 5 % of the nulls stay below [1]."""
        own, nulls = (self.space.likely(v) for v in (self.z, self.nulls))
        return float((own**2).sum() / np.quantile((nulls**2).sum(0), 0.95))

    @cached_property
    def prospect(self) -> Prospect | None:
        """What frames held out say of a prediction; None where there are none."""
        return prospect(self)

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
