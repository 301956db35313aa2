"""What a tracker and a camera make of true paths, drawn independently of body, solver and what is hidden."""

import math
from dataclasses import dataclass

import numpy as np

from surgisim.phantom.families.world import World

CAMERAS = ("still", "jitter", "drift", "walk")
ARM = 0.025
"""Where a camera's turn moves tissue as far as its shift does [m]."""


@dataclass(frozen=True)
class Seeing:
    sigma: float
    """Tracking noise of an axis [m]."""
    told: float
    """The same as the recording says it [m]."""
    lasting: float
    """Share of the variance that lasts from frame to frame [1]."""
    keep: float
    """Of which each frame keeps this much of the one before [1]."""
    shared: float
    """Share of the variance that neighbours have in common [1]."""
    reach: float
    """Distance at which they still do [m]."""
    offset: float
    """Constant error of a point, over sigma [1]."""
    tails: float
    """Degrees of freedom of Student's t; infinite for Gauss [1]."""
    lost: float
    """Times that a point is lost, a point and second [1/s]."""
    swapped: float
    """Share of points that are taken for a neighbour for a while [1]."""
    camera: str
    shake: float
    """How far the camera goes, over sigma [1]."""

    def between(self, rest: np.ndarray) -> np.ndarray:
        """Correlation of what the tracker adds at points `rest` [m], (K, 3), (K, K) [1]."""
        return (1 - self.shared) * np.eye(len(rest)) + self.shared * _near(rest, self.reach)

    def over_time(self, frames: int) -> np.ndarray:
        """The same of one point at all frames, (T, T) [1]."""
        lag = np.abs(np.subtract.outer(np.arange(frames), np.arange(frames)))
        return (1 - self.lasting) * np.eye(frames) + self.lasting * self.keep**lag

    def courses(self, frames: int) -> np.ndarray:
        """What the camera's six motions do over time, each a sum of these by independent unit normals, over sigma,
        (T, C) [1]."""
        if self.camera == "jitter":
            found = np.eye(frames)
        elif self.camera == "drift":
            found = 2 * np.linspace(0, 1, frames)[:, None]
        else:
            found = 2 / math.sqrt(frames) * np.tri(frames) * (self.camera == "walk")
        return self.shake * (found - found[:1])


def _near(rest: np.ndarray, reach: float) -> np.ndarray:
    away = np.linalg.norm(rest[:, None] - rest[None], axis=-1)
    return np.exp(-0.5 * (away / reach) ** 2)


def moves(points: np.ndarray, center: np.ndarray) -> np.ndarray:
    """How the camera's six motions move points [m], (..., 3), of tissue about `center`, (6, ..., 3) [1]: three shifts,
    and three turns, by as much as a shift at ARM."""
    shifts = [np.broadcast_to(axis, points.shape) for axis in np.eye(3)]
    turns = [np.cross(shift, points - center) / ARM for shift in shifts]
    return np.stack([*shifts, *turns])


def draw(rng: np.random.Generator) -> Seeing:
    sigma = 1e-4 * math.exp(rng.uniform(0, math.log(4)))
    correlated, offset, heavy = rng.uniform(size=3) < (0.6, 0.6, 0.25)
    return Seeing(
        sigma=sigma,
        told=sigma * math.exp(rng.uniform(-0.35, 0.35)),
        lasting=rng.uniform(0.2, 0.6) * correlated,
        keep=rng.uniform(0.5, 0.9),
        shared=rng.uniform(0.1, 0.5) * correlated,
        reach=rng.uniform(0.004, 0.010),
        offset=rng.uniform(0.2, 1.0) * offset,
        tails=rng.uniform(3.5, 8.0) if heavy else math.inf,
        lost=rng.uniform(0.0, 0.25),
        swapped=rng.uniform(0.0, 0.03) * (rng.uniform() < 0.3),
        camera=str(rng.choice(CAMERAS)),
        shake=rng.uniform(0.15, 0.8),
    )


def observed(world: World, true: np.ndarray, seeing: Seeing, rng: np.random.Generator) -> np.ndarray:
    """What is recorded [m], (K, T, 3), of true paths."""
    rest, (points, frames) = world.rest, true.shape[:2]
    away = np.linalg.norm(rest[:, None] - rest[None], axis=-1)
    mix = np.linalg.cholesky(_near(rest, seeing.reach) + 1e-6 * np.eye(points))

    def noise() -> np.ndarray:
        white = rng.standard_normal(true.shape)
        if math.isfinite(seeing.tails):
            chi = rng.chisquare(seeing.tails, (points, frames, 1)) / (seeing.tails - 2)
            white /= np.sqrt(chi)
        slow = rng.standard_normal(true.shape)
        for t in range(1, frames):
            slow[:, t] = seeing.keep * slow[:, t - 1] + math.sqrt(1 - seeing.keep**2) * slow[:, t]
        return math.sqrt(1 - seeing.lasting) * white + math.sqrt(seeing.lasting) * slow

    own, common = noise(), np.einsum("kj,jti->kti", mix, noise())
    error = math.sqrt(1 - seeing.shared) * own + math.sqrt(seeing.shared) * common
    error += seeing.offset * rng.standard_normal((points, 1, 3))
    told = true + seeing.sigma * error
    for k in np.flatnonzero(rng.uniform(size=points) < seeing.swapped):
        other = int(np.argsort(away[k])[1]) if points > 1 else k
        begin = int(rng.integers(1, frames))
        end = min(begin + int(rng.integers(2, max(frames // 5, 3))), frames)
        told[[k, other], begin:end] = told[[other, k], begin:end]
    courses = seeing.sigma * seeing.courses(frames)
    return told + np.einsum(
        "tm,mkti->kti", courses @ rng.standard_normal((courses.shape[1], 6)), moves(told, rest.mean(0))
    )


def visible(world: World, plain: np.ndarray, seeing: Seeing, rng: np.random.Generator) -> np.ndarray:
    """Which samples there are, (K, T) bool: none under the tools, and none where a point is lost.

    plain: paths [m] without what is hidden, which tells nothing of it, (K, T, 3).
    """
    points, frames = plain.shape[:2]
    free = np.ones((points, frames), bool)
    for grip in world.grips:
        reach, lead = grip.radius * rng.uniform(0.9, 1.2), int(rng.integers(1, 5))
        shaft, width = rng.standard_normal(3), rng.uniform(0.0015, 0.003)
        shaft /= np.linalg.norm(shaft)
        for t in range(max(grip.begin - lead, 1), min(grip.release + lead + 1, frames)):
            tip = grip.center + grip.path(np.clip(t, grip.begin, grip.release))
            off = plain[:, t] - tip
            along = off @ shaft
            beside = np.linalg.norm(off - np.outer(along, shaft), axis=1)
            free[:, t] &= ~((np.linalg.norm(off, axis=1) < reach) | ((along > 0) & (beside < width)))
    for _ in range(rng.poisson(seeing.lost * points * frames / world.fps)):
        k, t = int(rng.integers(points)), int(rng.integers(1, frames))
        free[k, t : t + int(rng.integers(2, max(round(0.5 * world.fps), 3)))] = False
    free[:, 0] = True
    return free
