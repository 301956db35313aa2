"""What is left between two solvers, as a covariance that residuals can be whitened with.

The difference e of a surface point is counted per unit of motion, e / A, with A how far the grip carries (load, hold)
or carried (release, rest) the tissue. Its standard deviation depends on the distance to that grip over its radius and
on the phase; its correlation falls as exp(-d / length) in space and exp(-s / time) in time, within a phase:

    cov(e_i(t), e_j(t')) = A A' s(r_i, phase) s(r_j, phase) exp(-|x_i - x_j| / length) exp(-|t - t'| / time) I

It is no noise: with every grip nearly the same pattern comes back. `mean` is that pattern at the end of a pull and
`modes` what varies most around it, on rings and directions around the grip, in axes along the pull's shadow on the
surface, across it, and out of the tissue.
"""

import numpy as np

from surgisim.verification.manipulated.scene import FINE, FPS, PHASES, Scene

EDGES = (0.0, 0.7, 1.0, 1.3, 1.6, 2.0, 2.5, 3.0, 4.0, 6.0, 12.0)
"""Rings around the grip, in its radii."""
DIRECTIONS = 8
MODES = 3
LONGEST = 10.0


def model_error(scenes: list[Scene], differences: list[np.ndarray]) -> dict:
    """The numbers of the covariance, from differences [m], (T, K, 3) at each scene's clock; JSON-able."""
    scaled = [_Scaled(scene, e) for scene, e in zip(scenes, differences, strict=True)]
    deviation = np.zeros((len(PHASES), len(EDGES) - 1))
    for k in range(len(PHASES)):
        ring = np.concatenate([s.ring[s.phase == k].ravel() for s in scaled])
        square = np.concatenate([(s.error[s.phase == k] ** 2).mean(-1).ravel() for s in scaled])
        count = np.bincount(ring, minlength=len(EDGES) - 1)[: len(EDGES) - 1]
        total = np.bincount(ring, square, len(EDGES) - 1)[: len(EDGES) - 1]
        deviation[k] = np.sqrt(total / np.maximum(count, 1))
    patterns = np.stack([p for scene, s in zip(scenes, scaled, strict=True) for p in s.patterns])
    mean = np.nansum(patterns, 0) / np.maximum(np.isfinite(patterns).sum(0), 1)
    rest = np.nan_to_num(patterns - mean).reshape(len(patterns), -1)
    _, sizes, modes = np.linalg.svd(rest, full_matrices=False)
    return {
        "edges": list(EDGES),
        "phases": list(PHASES),
        "deviation": deviation,
        "length": _length(scenes, scaled),
        "time": {name: _time(scaled, k) for k, name in enumerate(PHASES[:3])},
        "mean": mean,
        "modes": modes[:MODES].reshape(-1, *mean.shape),
        "sizes": sizes[:MODES] / np.sqrt(len(patterns)),
        "explained": (sizes[:MODES] ** 2).sum() / max((sizes**2).sum(), 1e-30),
        "pulls": len(patterns),
    }


def deviation(error: dict, radii: np.ndarray, phase: str, motion: float) -> np.ndarray:
    """Standard deviation of each component [m], (K,), at distances in radii of the grip, for a grip's `motion` [m]."""
    ring = np.clip(np.searchsorted(error["edges"], radii, side="right") - 1, 0, len(error["edges"]) - 2)
    return motion * np.asarray(error["deviation"])[error["phases"].index(phase)][ring]


def covariance(
    error: dict, points: np.ndarray, center: np.ndarray, radius: float, phase: str, motion: float
) -> np.ndarray:
    """Covariance of one component at rest points [m], (K, 3), at one instant [m^2], (K, K); components are alike."""
    s = deviation(error, np.linalg.norm(points - center, axis=1) / radius, phase, motion)
    apart = np.linalg.norm(points[:, None] - points[None], axis=-1)
    return s[:, None] * s[None] * np.exp(-apart / error["length"])


class _Scaled:
    """One scene's difference per unit of motion, at frames."""

    def __init__(self, scene: Scene, difference: np.ndarray) -> None:
        frames = np.arange((len(difference) - 1) // FINE + 1)
        self.phase = scene.phase()[frames]
        self.probes = scene.probes()
        self.ring = np.zeros((len(frames), len(self.probes)), int)
        self.error = difference[::FINE].copy()
        self.patterns, self.held = [], []
        for hold in scene.holds:
            until = scene.holds[1].begin if hold is scene.holds[0] else scene.frames
            mine = (frames >= hold.begin) & (frames < until)
            reach = np.linalg.norm(hold.path(np.minimum(frames, hold.release).astype(float)), axis=1)
            # Just after the grasp the motion is too small to divide by.
            reach = np.maximum(reach, 0.05 * np.linalg.norm(hold.pull))
            away = self.probes - hold.grip.uv
            radii = np.linalg.norm(away, axis=1) / hold.grip.radius
            self.ring[mine] = np.clip(np.searchsorted(EDGES, radii, side="right") - 1, 0, len(EDGES) - 2)
            self.error[mine] /= reach[mine, None, None]
            if hold.release < len(frames):
                self.held.append(hold.release)
                self.patterns.append(_pattern(scene, hold, radii, away, self.error[hold.release]))


def _pattern(scene, hold, radii, away, error) -> np.ndarray:
    """Mean difference in every ring and direction, in the pull's axes, (rings, DIRECTIONS, 3); NaN where none is."""
    u, v, depth = scene.shape.axes
    shadow = np.array([hold.pull @ u, hold.pull @ v])
    shadow = shadow / np.linalg.norm(shadow)
    across = np.array([-shadow[1], shadow[0]])
    axes = np.stack([shadow[0] * u + shadow[1] * v, across[0] * u + across[1] * v, -depth])
    angle = np.arctan2(away @ across, away @ shadow)
    direction = np.floor((angle / (2 * np.pi) + 0.5 / DIRECTIONS) % 1 * DIRECTIONS).astype(int)
    ring = np.clip(np.searchsorted(EDGES, radii, side="right") - 1, 0, len(EDGES) - 2)
    turned, result = error @ axes.T, np.full((len(EDGES) - 1, DIRECTIONS, 3), np.nan)
    for r in range(len(EDGES) - 1):
        for d in range(DIRECTIONS):
            mine = (ring == r) & (direction == d)
            if mine.any():
                result[r, d] = turned[mine].mean(0)
    return result


def _length(scenes, scaled) -> float:
    """Distance [m] over which the correlation of the standardised difference falls to 1/e, at the ends of pulls."""
    apart, product = [], []
    for scene, s in zip(scenes, scaled, strict=True):
        points = scene.shape.upper(s.probes)
        distance = np.linalg.norm(points[:, None] - points[None], axis=-1)
        for frame in s.held:
            size = np.array([_ring_size(s, frame, r) for r in s.ring[frame]])
            z = s.error[frame] / size[:, None]
            apart.append(distance.ravel())
            product.append((z @ z.T / 3).ravel())
    return _fall(np.concatenate(apart), np.concatenate(product), np.linspace(0, 0.03, 13))


def _time(scaled, phase: int) -> float:
    """Time [s] over which the correlation of the difference falls to 1/e within a phase."""
    apart, product = [], []
    for s in scaled:
        frames = np.flatnonzero(s.phase == phase)
        for part in np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1):
            part = part[s.error[part].any((1, 2))]
            if len(part) > 1:
                e = s.error[part].reshape(len(part), -1)
                size = np.sqrt((e**2).mean(1))
                apart.append((np.abs(part[:, None] - part[None]) / FPS).ravel())
                product.append((e @ e.T / e.shape[1] / size[:, None] / size[None]).ravel())
    if not apart:
        return 0.0
    return _fall(np.concatenate(apart), np.concatenate(product), (np.arange(13) - 0.5) / FPS)


def _ring_size(s, frame, ring) -> float:
    return float(np.sqrt((s.error[frame][s.ring[frame] == ring] ** 2).mean()))


def _fall(apart, product, edges) -> float:
    """Scale of exp(-apart / scale), by least squares on the logarithm of binned correlations above 0.1.

    At most LONGEST times what was looked at: what never falls there has no scale that could be told.
    """
    which = np.digitize(apart, edges) - 1
    bins = [(apart[which == k].mean(), product[which == k].mean()) for k in range(len(edges) - 1) if (which == k).any()]
    kept = np.array([(a, c) for a, c in bins[1:] if c > 0.1])
    if not len(kept):
        return float(edges[1])
    fall = -(kept[:, 0] @ np.log(np.minimum(kept[:, 1], 1.0))) / (kept[:, 0] @ kept[:, 0])
    return float(1 / max(fall, 1 / (LONGEST * edges[-1])))
