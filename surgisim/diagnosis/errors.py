"""How far prediction and recording lie apart, on frames that were fitted and on those that were not."""

import numpy as np

from surgisim.diagnosis import nuisance
from surgisim.diagnosis.noise import Noise
from surgisim.diagnosis.perceived import BY_VIDEO
from surgisim.diagnosis.saturated import smooth_part

LEAST = 3
"""Frames of rest that a point's constant is told from; seen in fewer, it is told from all that may be fitted."""


def residual(case, simulated, nan: bool = True, rest_only: bool = True, whole: bool = False) -> np.ndarray:
    """Recording less prediction less each point's own constant [m], (K, T, 3).

    The constant is the mean over the rest before the first grasp: over all fitted frames (`rest_only` False), where it
    is known better, it takes with it what physics adds to all of them. What lies along an axis of which the recording
    is less sure counts as much less (`Noise.told_of`), unless `whole`.
    """
    clip = case.clip
    left = np.where(clip.seen[..., None], clip.moved - simulated, 0.0)
    if case.settings.offsets:
        rest, fitted = slice(0, int(clip.held.argmax())), slice(0, clip.until)
        (constant, count), (instead, _) = (_mean(left, clip.seen, span) for span in (rest, fitted))
        resting = (count >= LEAST) & rest_only
        left = left - np.where(resting[:, None], constant, instead)[:, None]
    left = left if whole else case.noise.told_of(left)
    return np.where(clip.seen[..., None], left, np.nan if nan else 0.0)


def _mean(left: np.ndarray, seen: np.ndarray, span: slice) -> tuple[np.ndarray, np.ndarray]:
    """Of every point over the frames in `span` in which it is seen, (K, 3), and how many those are, (K,)."""
    count = seen[:, span].sum(1)
    return left[:, span].sum(1) / np.maximum(count, 1)[:, None], count


def as_filmed(case, simulated: np.ndarray) -> np.ndarray:
    """A prediction with what is likeliest beside it of the camera's drift and of what a video gets wrong, over all
    frames [m], (K, T, 3)."""
    groups = [g for g in case.groups if g.name in ("drift", *BY_VIDEO)]
    if not groups:
        return simulated
    likely, _ = _likely(case, simulated, whole=True)
    for group in groups:
        simulated = simulated + np.tensordot(likely[nuisance.span(case.groups, group.name)], group.columns, 1)
    return simulated


def beside_nuisances(case, simulated: np.ndarray, whole: bool = False) -> np.ndarray:
    """A prediction with everything that may be beside it, at its likeliest, in the fitted frames, and as it was in
    those held out; in all frames, where `whole` and any are held out [m], (K, T, 3)."""
    likely, span = _likely(case, simulated, whole)
    result, at = simulated.copy(), 0
    for group in case.groups:
        result[:, span] += np.tensordot(likely[at : at + len(group.columns)], group.columns[:, :, span], 1)
        at += len(group.columns)
    slopes = case.base.slopes
    result[:, : case.clip.until] += np.tensordot(likely[at : at + len(slopes)], slopes, 1)
    return result


def _likely(case, simulated: np.ndarray, whole: bool) -> tuple[np.ndarray, slice]:
    """How much of each nuisance is likeliest beside a prediction, (C,), and by which frames: the fitted ones, or all,
    where `whole` and any are held out."""
    left, ahead = case.clip.moved - simulated, case.prospect if whole else None
    if ahead is None:
        return case.space.likely(case.whiten(left[:, : case.clip.until])), slice(0, case.clip.until)
    return ahead.space_all.likely(ahead.whiten_all(left)), slice(0, case.clip.frames)


def rms(case, simulated) -> tuple[float, float | None]:
    """On fitted frames and on those held out [mm]."""
    left, until = residual(case, simulated), case.clip.until
    square = (left**2).sum(-1)
    fitted = 1e3 * float(np.sqrt(np.nanmean(square[:, :until])))
    if case.clip.frames == until or not case.clip.seen[:, until:].any():
        return fitted, None
    return fitted, 1e3 * float(np.sqrt(np.nanmean(square[:, until:])))


def noise_floor(noise: Noise) -> float:
    """RMS distance [mm] of a point from where noise shows it, of what the recording can tell of it."""
    return 1e3 * float(np.sqrt(3)) * noise.plain


def errors(case, before, after, placebo, noise: Noise) -> tuple[dict, dict]:
    """What diagnosis.json says of fitted frames and of those held out; placebo None where there is none.

    before, after, placebo: predicted displacement of the points [m], (K, T, 3).
    """
    clip, until = case.clip, case.clip.until
    floor = noise_floor(noise)
    rows = {name: rms(case, s) for name, s in (("before", before), ("after", after))}
    rows["placebo"] = (None, None) if placebo is None else rms(case, placebo)
    left = residual(case, before, False)
    parts = []
    for span in (slice(0, until), slice(until, clip.frames)):
        seen = clip.seen[:, span]
        if not seen.any():
            parts.append(None)
            continue
        parts.append(_beside_smooth(clip, left[:, span], seen))
    result = []
    for k in (0, 1):
        result.append({"noise_floor": floor, **{n: r[k] for n, r in rows.items()}, "flexible": parts[k], "unit": "mm"})
    low, high = bootstrap(case, before, after)
    result[1]["gain_low"], result[1]["gain_high"] = low, high
    return result[0], result[1]


def taken_off(case, simulated: np.ndarray, noise: Noise) -> float | None:
    """Share of what a smooth field could take off the held-out mean square that a prediction takes off; None where
    frames held out are off by no more than noise."""
    clip, until = case.clip, case.clip.until
    before, after = rms(case, case.base.simulated)[1], rms(case, simulated)[1]
    if before is None or before <= noise_floor(noise):
        return None
    seen, left = clip.seen[:, until:], residual(case, case.base.simulated, False)[:, until:]
    least = _beside_smooth(clip, left, seen)
    return (before**2 - after**2) / max(before**2 - least**2, 1e-12)


def _beside_smooth(clip, left: np.ndarray, seen: np.ndarray) -> float:
    """RMS [mm] of what a smooth field leaves of a residual [m], (K, F, 3), in samples `seen`, (K, F)."""
    return 1e3 * float(np.sqrt(((left - smooth_part(clip, left, seen))[seen] ** 2).sum(-1).mean()))


def bootstrap(case, before, after, draws: int = 200) -> tuple[float | None, float | None]:
    """90 % interval of what the law takes off the held-out mean square [mm^2], points drawn again.

    Of a video, beside what it gets wrong: that is larger than what is left, and alike in all points.
    """
    clip, until = case.clip, case.clip.until
    if clip.frames == until or not clip.seen[:, until:].any():
        return None, None
    if clip.recording.astray:
        before, after = as_filmed(case, before), as_filmed(case, after)
    square = [(residual(case, s, False)[:, until:] ** 2).sum((1, 2)) for s in (before, after)]
    count = clip.seen[:, until:].sum(1)
    rng = np.random.default_rng([case.settings.seed, 2])
    chosen = rng.integers(0, len(count), (draws, len(count)))
    gains = 1e6 * (square[0] - square[1])[chosen].sum(1) / np.maximum(count[chosen].sum(1), 1)
    return float(np.quantile(gains, 0.05)), float(np.quantile(gains, 0.95))
