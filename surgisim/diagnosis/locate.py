"""Where the symptom is, and where its cause may be."""

import numpy as np

from surgisim.diagnosis.base import Base
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.evidence import Finding
from surgisim.diagnosis.noise import Noise, Whitener

REACH = 0.006
"""Over which neighbours are averaged [m]."""
FRAMES = 2.0
"""Standard deviation of the average in time, in frames."""
DRAWS = 12
WORST = 0.95
"""Quantile of the largest value that noise alone gives, beyond which a place counts as significant."""


def symptom(clip: Clip, noise: Noise, residual: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """How many standard deviations the smoothed residual is long, (K, T), and what noise alone reaches somewhere.

    residual: over the whole clip [m], (K, T, 3).
    """
    smooth = _smoother(clip)
    drawn = (noise.told_of(noise.draw(clip.rest, clip.frames, rng)) for _ in range(DRAWS))
    draws = np.stack([np.linalg.norm(smooth(field), axis=-1) for field in drawn])
    unit = np.sqrt((draws**2).mean((0, 2)) / 3)[:, None]
    z = np.linalg.norm(smooth(residual), axis=-1) / unit
    return z, float(np.quantile((draws / unit).max((1, 2)), WORST))


def worst(clip: Clip, simulated: np.ndarray, noise: Noise) -> np.ndarray:
    """The point that the fitted frames find farthest from where it is predicted, its mean off [m], (3,)."""
    seen = clip.seen[:, : clip.until, None]
    left = np.where(seen, noise.told_of(clip.moved - simulated)[:, : clip.until], np.nan)
    left = left - np.nanmean(left, 1, keepdims=True)
    return clip.rest[int(np.nanmean((left**2).sum(-1), 1).argmax())]


def _smoother(clip: Clip):
    away = np.linalg.norm(clip.rest[:, None] - clip.rest[None], axis=-1)
    weight = np.exp(-0.5 * (away / REACH) ** 2)
    lag = np.arange(clip.frames)
    window = np.exp(-0.5 * ((lag[:, None] - lag[None]) / FRAMES) ** 2)
    seen = clip.seen.astype(float)
    share = weight @ seen @ window

    def smooth(field: np.ndarray) -> np.ndarray:
        kept = np.moveaxis(field * seen[..., None], -1, 0)
        return np.moveaxis(weight @ kept @ window / np.maximum(share, 1e-9), 0, -1)

    return smooth


def cause(base: Base, whiten: Whitener, z: np.ndarray, nulls: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Score of a push at every particle, (P,), and at every fitted frame, (T,), over what noise gives.

    z: the residual, whitened and freed of nuisances, (N,); nulls: the same of noise, (N, D). One adjoint pass: the
    misfit's gradient by a force on every node, at every frame, through the tangent stiffness.
    """
    near = base.tangent

    def scores(white: np.ndarray) -> np.ndarray:
        field = whiten.back(white)
        K, T = field.shape[:2]
        flat = field.swapaxes(0, 1).reshape(T, 3 * K)
        pushed = np.zeros((T, near.answer.shape[2]))
        for s, answer in enumerate(near.answer):
            mine = near.share[:, s] > 0
            pushed[mine] += near.share[mine, s, None] * (flat[mine] @ answer)
        return np.linalg.norm((near.value @ pushed.T).reshape(-1, 3, T), axis=1)

    mine = scores(z)
    null = np.sqrt(np.mean([scores(n) ** 2 for n in nulls.T], 0))
    unit = np.maximum(null, 0.05 * null.max())
    ratio = mine / unit
    return np.sqrt((ratio**2).mean(1)), np.sqrt((ratio**2).mean(0))


def of_places(clip: Clip, findings: list[Finding], rest: np.ndarray) -> np.ndarray:
    """Probability of a local law's place, spread over the particles, at most 1, (P,)."""
    logs = np.array([f.log_evidence for f in findings])
    share = np.exp(logs - logs.max())
    heat = sum(
        w * f.hypothesis.place.weight(rest) for w, f in zip(share / share.sum(), findings, strict=True) if w > 1e-3
    )
    return heat / max(heat.max(), 1e-30)
