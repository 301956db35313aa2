"""From a hypothesis and its amplitude to laws the engine runs."""

from collections.abc import Sequence

import numpy as np

from surgisim.diagnosis import candidates
from surgisim.diagnosis.base import SAFETY, Base, boldly, carried, values_on
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.knobs import turned
from surgisim.diagnosis.law import Law
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.uncertain import Spread
from surgisim.estimation.identify import NINETY
from surgisim.mpm.closing import follow
from surgisim.mpm.setup import Prepared
from surgisim.mpm.simulator import Breakdown, Run
from surgisim.physics.place import Misplaced

IMPOSSIBLE = (Breakdown, Misplaced)
"""Tissue torn apart, or a place outside the body: not a law of this clip."""


COARSE = 200
"""Draws from what may be turned about a law, of which intervals are read where none was fitted."""


class Clash(ValueError):
    """Two laws that need the same term: a body has each once."""


def law_of(h: Hypothesis, amplitude: np.ndarray, clip: Clip) -> Law:
    """The law of a hypothesis, as strong as its amplitudes, (H,), say."""
    return candidates.of(h).law(h, amplitude, clip)


def joined(laws: Sequence[Law]) -> Law:
    """All of them at once. Raises Clash where two need the same term."""
    values, places, motion = {}, {}, None
    for law in laws:
        if set(law.values) & set(values) or (motion is not None and law.motion is not None):
            raise Clash(f"{sorted(law.values)} and {sorted(values)}")
        values, places, motion = values | law.values, places | law.places, law.motion or motion
    return Law(values, places, motion)


def beside(h: Hypothesis, amplitude: np.ndarray, stiffer: float) -> tuple[Hypothesis, np.ndarray]:
    """The law that does the same in tissue `stiffer` times as stiff."""
    same = candidates.of(h).beside
    return (h, amplitude) if same is None else same(h, amplitude, stiffer)


def run_with(clip: Clip, base: Base, law: Law, frames: int) -> tuple[Prepared, Run]:
    """The body under base and law, as the engine runs it. Raises what is IMPOSSIBLE.

    base: its x may be followed by moments of release, (3 + R,).
    """
    clip = clip.opens(base.x[3:])
    values = {**values_on(clip, base.x), **law.values}
    motion = clip.motion if law.motion is None else law.motion
    prepared = clip.prepared(tuple(values), motion=motion)
    theta = prepared.theta(values, law.places)

    def at(safety: float) -> Run:
        per_frame = steps(clip, prepared, theta, safety)
        drive = prepared.drive(
            motion,
            values,
            fps=clip.fps,
            per_frame=per_frame,
            frames=clip.frames,
            places=law.places,
            late=clip.opening,
        )
        if clip.shifted:
            return follow(prepared.simulator, theta, drive, last=frames - 1)
        return prepared.simulator.run(theta, drive, last=frames - 1)

    return prepared, boldly(at)


def respond(clip: Clip, base: Base, law: Law, memo: Memo, frames: int | None = None) -> np.ndarray:
    """Displacement of the points with the law [m], (K, frames, 3), by the engine. Raises what is IMPOSSIBLE.

    base: as for `run_with`.
    """
    frames, opened = frames or clip.frames, clip.opens(base.x[3:])
    values = {**values_on(opened, base.x), **law.values}

    def make() -> dict[str, np.ndarray]:
        prepared, run = run_with(clip, base, law, frames)
        return {"seen": carried(prepared.simulator.carry(clip.rest), run).astype(np.float32)}

    moved = None if law.motion is None else np.round(law.motion.position, 9).tolist()
    where = {n: [list(p.center), p.extent, p.normal] for n, p in law.places.items()}
    return memo(["law", values, _plain(where), moved, frames, *opened.kind], make)["seen"].astype(float)


def steps(clip: Clip, prepared: Prepared, theta: np.ndarray, safety: float = SAFETY) -> int:
    """Steps a frame with the laws of `theta`."""
    return prepared.per_frame_of(prepared.stiffest(theta), clip.fps, safety)


def described(
    h: Hypothesis, amplitude: np.ndarray, spread: np.ndarray, clip: Clip, base: Base,
    draws: Sequence[tuple[Hypothesis, np.ndarray]] = (),
) -> dict[str, dict]:  # fmt: skip
    """Parameters with 90 % intervals and units, as diagnosis.json has them.

    draws: the law with other numbers that would do; without them its strength has the interval of `spread`, and the
    others are as uncertain as the search was coarse.
    """
    if draws:
        return _of_draws(h, amplitude, clip, draws)
    candidate = candidates.of(h)
    known = Spread(amplitude, spread, NINETY * float(base.spread[0]))
    knobs = candidate.knobs(h, amplitude)
    coarse = [turned(h, amplitude, knobs, x, clip) for x in np.random.default_rng(0).normal(size=(COARSE, len(knobs)))]
    result = _of_draws(h, amplitude, clip, coarse)
    for key, (value, _) in candidate.parameters(h, amplitude, clip).items():
        low, high = candidate.interval(key, value, known)
        if low < high:
            result[key] |= {"low": float(low), "high": float(high)}
    return result


def _of_draws(h: Hypothesis, amplitude: np.ndarray, clip: Clip, draws) -> dict[str, dict]:
    value = candidates.of(h).parameters(h, amplitude, clip)
    near = [candidates.of(draw).parameters(draw, size, clip) for draw, size in draws]
    result = {}
    for key, (best, unit) in value.items():
        off = np.array([n[key][0] - best for n in near])
        if unit == "rad":
            off = (off + np.pi) % (2 * np.pi) - np.pi
        low, high = np.quantile(off, [0.05, 0.95])
        result[key] = {
            "value": best, "low": best + min(float(low), 0.0), "high": best + max(float(high), 0.0), "unit": unit,
        }  # fmt: skip
    return result


def _plain(value):
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return None if value is None else float(value)


__all__ = [
    "IMPOSSIBLE", "Clash", "Law", "beside", "described", "joined", "law_of", "respond", "run_with", "steps",
]  # fmt: skip
