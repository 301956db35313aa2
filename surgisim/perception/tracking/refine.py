"""Find patches of the first frame again to a fraction of a pixel, whatever the light does.

Inverse compositional registration (Baker and Matthews, Lucas-Kanade 20 years on, 2004) of a patch whose shape is
already corrected by a dense warp: what is left is a small shift, a gain and an offset of the brightness.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from surgisim.perception.tracking.between import sample

STEPS = 4


@dataclass(frozen=True)
class Templates:
    """Patches of the first frame around K points, with all that does not change from frame to frame."""

    queries: np.ndarray
    """[px], (K, 2)."""
    offsets: np.ndarray
    """Pixels of a patch about its centre [px], (N, 2)."""
    value: np.ndarray
    """Grey, (K, N)."""
    slope: np.ndarray
    """Change of grey along x and y [1/px], (K, N, 2)."""
    weight: np.ndarray
    """How much each pixel counts, (K, N)."""


@dataclass(frozen=True)
class Found:
    """What was found of the patches in one frame."""

    shift: np.ndarray
    """Against where the warp has them, in pixels of the first frame [px], (K, 2)."""
    sigma: np.ndarray
    """Standard deviation of each coordinate of it [px], (K,)."""
    likeness: np.ndarray
    """Correlation with the template, -1 to 1, (K,)."""


def templates(grey: np.ndarray, queries: np.ndarray, hidden: np.ndarray, *, radius: int) -> Templates:
    """Patches of `grey` (H, W) float32 around `queries`, pixels of `hidden` (H, W) not counting."""
    side = np.arange(-radius, radius + 1, dtype=np.float32)
    offsets = np.stack(np.meshgrid(side, side), -1).reshape(-1, 2)
    at = queries[:, None] + offsets
    slope_x = cv2.Scharr(grey, cv2.CV_32F, 1, 0, scale=1 / 32)
    slope_y = cv2.Scharr(grey, cv2.CV_32F, 0, 1, scale=1 / 32)
    bell = np.exp(-(offsets**2).sum(-1) / (2 * (0.6 * radius) ** 2))
    return Templates(
        queries=queries.astype(np.float32),
        offsets=offsets,
        value=sample(grey, at),
        slope=np.stack([sample(slope_x, at), sample(slope_y, at)], -1),
        weight=bell * (sample(hidden.astype(np.float32), at) < 0.01),
    )


def find(patches: Templates, grey: np.ndarray, position: np.ndarray, hidden: np.ndarray) -> Found:
    """The patches in a frame `grey` (H, W) float32 whose warp from frame 0 is `position` (H, W, 2) [px]."""
    count = len(patches.queries)
    shift = np.zeros((count, 2))
    covered = hidden.astype(np.float32)
    for _ in range(STEPS):
        at = _where(patches, position, shift)
        weight = patches.weight * (sample(covered, at) < 0.01)
        now, gain = _match_light(patches.value, sample(grey, at), weight)
        step, spread_ = _solve(_unlit(patches.slope, patches.value, weight), now - patches.value, weight)
        shift = shift - step
        shift *= np.minimum(1.0, 4.0 / np.maximum(np.linalg.norm(shift, axis=-1, keepdims=True), 1e-9))
    enough = weight.sum(-1) > 0.4 * np.maximum(patches.weight.sum(-1), 1e-9)
    settled = enough & (np.linalg.norm(step, axis=-1) < 0.2) & (gain > 0)
    return Found(shift, np.where(settled, spread_, np.inf), _correlation(patches.value, now, weight))


def _where(patches: Templates, position: np.ndarray, shift: np.ndarray) -> np.ndarray:
    return sample(position, patches.queries[:, None] + patches.offsets + shift[:, None])


def _match_light(want: np.ndarray, have: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`have` brought to the mean and contrast of `want`, and the gain that took."""
    total = weight.sum(-1, keepdims=True) + 1e-6
    a, b = want - (weight * want).sum(-1, keepdims=True) / total, have - (weight * have).sum(-1, keepdims=True) / total
    gain = (weight * a * b).sum(-1, keepdims=True) / ((weight * b * b).sum(-1, keepdims=True) + 1e-6)
    return want - a + gain * b, gain[:, 0]


def _unlit(slope: np.ndarray, value: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """The part of `slope` (K, N, 2) that no gain or offset of the brightness can mimic."""
    total = weight.sum(-1, keepdims=True) + 1e-6
    a = value - (weight * value).sum(-1, keepdims=True) / total
    free = slope - weight[:, None] @ slope / total[..., None]
    share = (weight * a)[:, None] @ free / ((weight * a * a).sum(-1) + 1e-6)[:, None, None]
    return free - a[..., None] * share


def _solve(slope: np.ndarray, rest: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least-squares shift (K, 2) that explains `rest`, and its standard deviation (K,)."""
    weighted = (weight[..., None] * slope).transpose(0, 2, 1)
    pull = weighted @ slope + 1e-3 * np.eye(2)
    push = (weighted @ rest[..., None])[..., 0]
    inverse = np.linalg.inv(pull)
    noise = (weight * rest**2).sum(-1) / (weight.sum(-1) + 1e-6)
    worst = np.linalg.eigvalsh(inverse)[:, 1]
    return np.einsum("kij,kj->ki", inverse, push), np.sqrt(noise * worst)


def _correlation(want: np.ndarray, have: np.ndarray, weight: np.ndarray) -> np.ndarray:
    total = weight.sum(-1, keepdims=True) + 1e-6
    a, b = want - (weight * want).sum(-1, keepdims=True) / total, have - (weight * have).sum(-1, keepdims=True) / total
    return (weight * a * b).sum(-1) / np.sqrt((weight * a * a).sum(-1) * (weight * b * b).sum(-1) + 1e-6)
