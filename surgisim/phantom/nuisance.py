"""What a camera and a tracker add to true paths, whatever the tissue does."""

import math

import numpy as np

from surgisim.phantom.scene import Scene

OFFSET = 0.6
"""Reference offset of a point over the tracking noise: each axis, constant in time."""
ALIKE = 0.006
"""Distance at which neighbours' errors are still alike [m]."""


def seen(rest: np.ndarray, true: np.ndarray, sigma: float, rng: np.random.Generator) -> np.ndarray:
    """Observed positions [m] for true ones, (K, T, 3), of points that sit at `rest` [m], (K, 3).

    Noise of standard deviation `sigma` [m] an axis, of which a part lasts (AR(1)) and is shared by neighbours;
    a constant offset of each point; a rigid jitter of the camera.
    """
    points, frames = true.shape[:2]
    away = np.linalg.norm(rest[:, None] - rest[None], axis=-1)
    kernel = np.exp(-0.5 * (away / (ALIKE * rng.uniform(0.6, 1.4))) ** 2) + 1e-6 * np.eye(points)
    mix = np.linalg.cholesky(kernel)
    shared, lasting = rng.uniform(0.2, 0.5), rng.uniform(0.2, 0.5)
    own = _ar1(rng, (points, frames, 3), rng.uniform(0.6, 0.9))
    common = np.einsum("kj,jti->kti", mix, _ar1(rng, (points, frames, 3), rng.uniform(0.6, 0.9)))
    white = rng.standard_normal(true.shape)
    noise = math.sqrt(shared) * common + math.sqrt(lasting * (1 - shared)) * own
    noise += math.sqrt((1 - lasting) * (1 - shared)) * white
    # Some points are tracked better than others, and nobody says which.
    each = np.exp(0.2 * rng.standard_normal(points))
    noise *= (each / np.sqrt((each**2).mean()))[:, None, None]
    offset = OFFSET * sigma * rng.standard_normal((points, 1, 3))
    return jitter(true + sigma * noise + offset, rest.mean(0), sigma, rng)


def jitter(points: np.ndarray, center: np.ndarray, sigma: float, rng: np.random.Generator) -> np.ndarray:
    """Shaken rigidly, by about sigma/4 at the centre and at 25 mm from it."""
    shift = 0.25 * sigma * _ar1(rng, (1, points.shape[1], 3), 0.5)
    angle = 0.25 * sigma / 0.025 * _ar1(rng, (1, points.shape[1], 3), 0.5)
    return points + shift + np.cross(np.broadcast_to(angle, points.shape), points - center)


def _ar1(rng: np.random.Generator, shape: tuple[int, ...], keep: float) -> np.ndarray:
    """Unit variance, each frame (axis 1) keeping a share of the one before."""
    noise = rng.standard_normal(shape)
    for t in range(1, shape[1]):
        noise[:, t] = keep * noise[:, t - 1] + math.sqrt(1 - keep * keep) * noise[:, t]
    return noise


def visible(scene: Scene, plain: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Which points are seen, (K, T): not under the tools, and not lost for moments.

    `plain` are the paths [m] without any effect, (K, T, 3): what is hidden tells nothing of the effect.
    """
    points, frames = plain.shape[:2]
    free = np.ones((points, frames), bool)
    for hold in scene.holds:
        turn = rng.uniform(0, 2 * np.pi)
        shaft = np.array([math.cos(turn), math.sin(turn)])
        reach, width = hold.grip.radius * rng.uniform(0.9, 1.1), rng.uniform(2e-3, 3e-3)
        center = scene.shape.upper(hold.grip.uv)
        lead = int(rng.integers(1, 5))
        for t in range(max(hold.begin - lead, 1), min(hold.release + lead + 1, frames)):
            tip = center + hold.path(np.array([np.clip(t, hold.begin, hold.release)]))[0]
            off = (plain[:, t] - tip)[:, :2]
            along = off @ shaft
            beside = np.abs(off @ np.array([-shaft[1], shaft[0]]))
            free[:, t] &= ~((np.linalg.norm(off, axis=1) < reach) | ((along > 0) & (beside < width)))
    for _ in range(rng.poisson(0.4 * points)):
        k, t = rng.integers(points), rng.integers(1, frames)
        free[k, t : t + rng.integers(2, 12)] = False
    # The first frame says where a point sits.
    free[:, 0] = True
    return free
