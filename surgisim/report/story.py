"""What is drawn, gathered once: a run with its material and numbers."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from surgisim.artifacts.material import Material
from surgisim.artifacts.metrics import Metrics
from surgisim.config.report import Report
from surgisim.measure.grasp_error import release
from surgisim.measure.phases import phases
from surgisim.measure.run import Run
from surgisim.report.moments import moments
from surgisim.skin import skin


@dataclass(frozen=True)
class Story:
    run: Run
    material: Material
    metrics: Metrics
    settings: Report

    @cached_property
    def time(self) -> np.ndarray:
        """[s], (T,)."""
        return np.arange(self.run.camera.frames) / self.run.camera.fps

    @cached_property
    def depth_range(self) -> tuple[float, float]:
        """What the depth colours span [m]."""
        low, high = np.percentile(self.run.depth.z, [1, 99])
        return float(low), float(max(high, low + 1e-6))

    @cached_property
    def skin(self) -> np.ndarray:
        """Triangles around the body, (F, 3) int."""
        return skin(self.run.body)

    @cached_property
    def phase(self) -> np.ndarray:
        return phases(self.run.motion)

    @cached_property
    def moments(self) -> list[int]:
        return moments(self.run.motion, self.settings.moments)

    @cached_property
    def release(self) -> float | None:
        """When the last grip lets go [s]; None when it never does."""
        last = max((release(a) for a in self.run.motion.active), default=self.run.camera.frames)
        return last / self.run.camera.fps if last < self.run.camera.frames else None

    @property
    def replayed(self) -> bool:
        """Whether the replay was rendered over the recording's frames."""
        return self.run.replay.rgb.shape == self.run.frames.rgb.shape

    def value(self, group: str, name: str) -> float | None:
        return self.metrics.values.get(group, {}).get(name, {}).get("value")

    def series(self, group: str, name: str) -> np.ndarray | None:
        found = self.metrics.values.get(group, {}).get(name, {}).get("series")
        return None if found is None else np.array([np.nan if v is None else v for v in found])
