"""Grasp error: whether the right tissue is carried along the right path for the right time."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.motion import Motion


@dataclass(frozen=True)
class GraspError:
    center: float
    """Distance of the gripped balls' centres at rest, the worst of the grips [m]."""
    path: float
    """Root mean square distance of the centres while both hold [m]."""
    release: float
    """Release found minus true release, the largest of the grips [frames]; 0 when neither lets go."""


def grasp_error(found: Motion, true: Motion, *, scale: float = 1.0) -> GraspError | None:
    """Each true grip against the found one nearest at rest; found lengths times `scale`. None without either."""
    if len(found.radius) == 0 or len(true.radius) == 0:
        return None
    centers, paths, releases = [], [], []
    for j in range(len(true.radius)):
        i = nearest(found, true, j, scale)
        both = found.active[i] & true.active[j]
        centers.append(np.linalg.norm(scale * found.center_rest[i] - true.center_rest[j]))
        paths.append(np.sum((scale * found.position[i] - true.position[j])[both] ** 2, -1))
        releases.append(release(found.active[i]) - release(true.active[j]))
    together = np.concatenate(paths)
    path = float(np.sqrt(together.mean())) if len(together) else float("nan")
    return GraspError(float(max(centers)), path, float(max(releases, key=abs)))


def nearest(found: Motion, true: Motion, grip: int, scale: float) -> int:
    """The found grip whose centre at rest is nearest to that of true grip number `grip`."""
    return int(np.argmin(np.linalg.norm(scale * found.center_rest - true.center_rest[grip], axis=-1)))


def release(active: np.ndarray) -> int:
    """First frame after the last hold, (T,) bool; T when it never lets go."""
    held = np.flatnonzero(active)
    return int(held[-1]) + 1 if len(held) else len(active)
