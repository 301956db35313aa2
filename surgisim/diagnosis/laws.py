"""From a hypothesis and its amplitude to laws the engine runs."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from surgisim.artifacts.motion import Motion
from surgisim.diagnosis.base import SAFETY, Base, boldly, carried
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.hypothesis import RISE, SETS_IN, Hypothesis
from surgisim.diagnosis.memo import Memo
from surgisim.mpm.closing import follow
from surgisim.mpm.setup import Prepared, Values
from surgisim.mpm.simulator import Breakdown, Run
from surgisim.physics.catalogue import choose
from surgisim.physics.heading import across_of
from surgisim.physics.place import Misplaced, Place

SPHERE = 0.45
"""2 (4 - 5 nu) / 15 (1 - nu) near nu = .45."""
SOFTEST, STIFFEST = 0.06, 40.0
NEVER = 59.0
"""An end after every clip [s]."""
IMPOSSIBLE = (Breakdown, Misplaced)
"""Tissue torn apart, or a place outside the body: not a law of this clip."""


class Clash(ValueError):
    """Two laws that need the same term: a body has each once."""


@dataclass(frozen=True)
class Law:
    """What is added to the base."""

    values: Values
    places: dict[str, Place]
    motion: Motion | None = None
    """Where a grip does not carry its tissue along as recorded."""


def law_of(h: Hypothesis, amplitude: np.ndarray, clip: Clip) -> Law:
    """The law of a hypothesis, as strong as its amplitudes, (H,), say."""
    a, term = float(amplitude[0]), h.term
    here = {} if h.place is None else {term: h.place}
    end = NEVER if h.end is None else h.end - RISE / 2
    if term == "hidden_contact":
        return Law({term: _push(amplitude, h.onset + RISE / 2, end)}, here)
    if term == "added_mass":
        push = _push(a * h.about["down"], h.onset + RISE / 2, NEVER)
        return Law({term: {"mass": abs(a) / 9.81}, "hidden_contact": push}, {**here, "hidden_contact": h.place})
    if term == "tether":
        yaw, pitch = angles(h.about["down"])
        own = {"slack": h.about["slack"], "length": h.about["length"], "yaw": yaw, "pitch": pitch}
        return Law({term: {"stiffness": a, **own}}, here)
    if term == "gravity":
        return Law({term: {**dict(zip("xyz", map(float, amplitude), strict=True)), "onset": h.onset + RISE / 2}}, {})
    if term == "respiration":
        return Law({term: _breath(amplitude.reshape(4, 3), h.about["rate"])}, {})
    if term == "tool_slip":
        return Law({}, {}, _slipped(clip, h, a))
    if term in ("stiff_inclusion", "base_layer"):
        return Law({"stiff_inclusion": {"s": stiffness_of(a)}}, {"stiff_inclusion": h.place})
    if term == "stiffening":
        return Law({term: {"k": a}}, {})
    if term == "fibre":
        yaw, pitch = angles(h.about["axis"])
        return Law({term: {"k1": a, "k2": h.about["k2"], "yaw": yaw, "pitch": pitch}}, {})
    if term == "pretension":
        return Law({term: {**_tension(amplitude, h.about["plane"]), "grows": h.about["grows"]}}, {})
    if term == "relaxation":
        return Law({term: {"G": a, "tau": h.about["tau"]}}, {})
    if term == "plastic_set":
        return Law({term: {"yield_strain": h.about["yield_strain"], "share": min(a, 1.0)}}, {})
    if term == "damage":
        return Law({term: {"onset": h.about["onset"], "rate": a, "most": h.about["most"]}}, {})
    if term == "sliding_base":
        yaw, pitch = angles(clip.normal)
        own = {"share": 1.0, "stiffness": h.about["stiffness"], "yaw": yaw, "pitch": pitch}
        return Law({term: {**own, "cap": h.about["cap"] / max(a, 1e-3)}}, {})
    return Law({"active_contraction": {"tension": a, **_waves(h, clip)}}, {})


def joined(laws: Sequence[Law]) -> Law:
    """All of them at once. Raises Clash where two need the same term."""
    values, places, motion = {}, {}, None
    for law in laws:
        if set(law.values) & set(values) or (motion is not None and law.motion is not None):
            raise Clash(f"{sorted(law.values)} and {sorted(values)}")
        values, places, motion = values | law.values, places | law.places, law.motion or motion
    return Law(values, places, motion)


FORCES = (
    "hidden_contact",
    "added_mass",
    "tether",
    "gravity",
    "stiffening",
    "fibre",
    "pretension",
    "relaxation",
    "active_contraction",
    "sliding_base",
)
"""Laws whose strength shows only over the tissue's own stiffness."""


def beside(h: Hypothesis, amplitude: np.ndarray, stiffer: float) -> tuple[Hypothesis, np.ndarray]:
    """The law that does the same in tissue `stiffer` times as stiff."""
    if h.term not in FORCES:
        return h, amplitude
    if h.term == "sliding_base":
        return replace(h, about={k: stiffer * v for k, v in h.about.items()}), amplitude
    return h, stiffer * amplitude


def _waves(h: Hypothesis, clip: Clip) -> dict[str, float]:
    """The rhythm of a contraction, counted from long before every part's first wave; `begin` is when it sets in."""
    yaw, pitch = angles(h.about["axis"])
    period, slowness = h.about["period"], h.about["period"] / h.about["wavelength"]
    onset = -h.about["phase"] / (2 * np.pi) * period
    along = clip.body.rest.astype(float) @ np.asarray(h.about["axis"], float)
    onset -= period * math.ceil((onset + slowness * (along.max() - along.mean())) / period)
    rhythm = {"onset": onset, "period": period, "duty": 0.5, "slowness": slowness}
    return {**rhythm, "yaw": yaw, "pitch": pitch, "begin": h.onset + SETS_IN / 2}


def stiffness_of(amplitude: float) -> float:
    """How stiff a lump is whose effect, to first order, would be that of s = 1 + amplitude.

    A stiff lump takes up ever less strain: amplitude = (s - 1) / (1 + b (s - 1)), with b of a sphere in tissue that
    hardly changes its volume (Eshelby 1957, section 4).
    """
    left = 1 - SPHERE * amplitude
    s = 1 + amplitude / left if left > 0 else STIFFEST
    return float(np.clip(s, SOFTEST, STIFFEST))


def respond(clip: Clip, base: Base, law: Law, memo: Memo, frames: int | None = None) -> np.ndarray:
    """Displacement of the points with the law [m], (K, frames, 3), by the engine. Raises what is IMPOSSIBLE."""
    frames = frames or clip.frames
    values = {**base.values, **law.values}
    motion = clip.motion if law.motion is None else law.motion

    def make() -> dict[str, np.ndarray]:
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

        run = boldly(at)
        return {"seen": carried(prepared.simulator.carry(clip.rest), run).astype(np.float32)}

    moved = None if law.motion is None else np.round(law.motion.position, 9).tolist()
    where = {n: [list(p.center), p.extent, p.normal] for n, p in law.places.items()}
    return memo(["law", base.x.tolist(), values, _plain(where), moved, frames, *clip.kind], make)["seen"].astype(float)


def steps(clip: Clip, prepared: Prepared, theta: np.ndarray, safety: float = SAFETY) -> int:
    """Steps a frame with the laws of `theta`."""
    return prepared.per_frame_of(prepared.stiffest(theta), clip.fps, safety)


def angles(direction: np.ndarray) -> tuple[float, float]:
    """Yaw and pitch [rad] that point along a direction, (3,)."""
    x, y, z = np.asarray(direction, float) / max(np.linalg.norm(direction), 1e-30)
    return math.atan2(x, z), math.asin(min(max(y, -1.0), 1.0))


def _push(force: np.ndarray, onset: float, end: float) -> dict[str, float]:
    yaw, pitch = angles(force)
    return {"force": float(np.linalg.norm(force)), "yaw": yaw, "pitch": pitch, "onset": float(onset), "end": float(end)}


def _breath(parts: np.ndarray, rate: float) -> dict[str, float]:
    """From sine and cosine of two harmonics along three axes, (4, 3), to one direction.

    What has a larger second harmonic than its first breathes twice as fast, without one.
    """
    scaled = parts * np.array([1.0, 1.0, 0.5, 0.5])[:, None]
    left, size, right = np.linalg.svd(scaled, full_matrices=False)
    s, c, s2, c2 = left[:, 0] * size[0]
    if math.hypot(s2, c2) > math.hypot(s, c):
        s, c, s2, c2, rate = s2, c2, 0.0, 0.0, 2 * rate
    first, second = math.hypot(s, c), math.hypot(s2, c2)
    yaw, pitch = angles(right[0])
    return {
        "amplitude": max(first, 1e-9), "period": 1 / rate, "phase": math.atan2(c, s),
        "second": second / max(first, 1e-9), "second_phase": math.atan2(c2, s2), "yaw": yaw, "pitch": pitch,
    }  # fmt: skip


def _tension(amplitude: np.ndarray, plane: np.ndarray) -> dict[str, float]:
    """From threads a third of a turn apart in a plane, (3,), to the tensions along its two main directions."""
    turns = np.arange(3) * np.pi / 3
    axes = np.stack([np.cos(turns), np.sin(turns)], 1)
    values, vectors = np.linalg.eigh(np.einsum("h,hi,hj->ij", amplitude, axes, axes))
    a, b = vectors[:, 1] @ plane, vectors[:, 0] @ plane
    yaw, pitch = angles(a)
    right, down = across_of(yaw, pitch)
    along, across = max(float(values[1]), 1e-6), max(float(values[0]), 0.0)
    return {"along": along, "across": across, "yaw": yaw, "pitch": pitch, "roll": math.atan2(b @ down, b @ right)}


def lag(h: Hypothesis, clip: Clip) -> np.ndarray:
    """Share of its path by which a slipping grip of amplitude 1 stays behind, (T,)."""
    motion, j = clip.motion, int(h.about["grip"])
    path = motion.position[j] - motion.center_rest[j]
    length, on = np.linalg.norm(path, axis=1), motion.active[j]
    if h.about["tau"] > 0:
        late = np.maximum(clip.time - h.onset, 0) / h.about["tau"]
        return np.where(on, (1 - np.exp(-late)) ** 2, 0.0)
    start = np.interp(h.onset, clip.time, length)
    return np.where(on & (clip.time > h.onset), np.maximum(length - start, 0) / np.maximum(length, 1e-9), 0.0)


def _slipped(clip: Clip, h: Hypothesis, amplitude: float) -> Motion:
    motion, j = clip.motion, int(h.about["grip"])
    position = motion.position.copy()
    path = position[j] - motion.center_rest[j]
    position[j] = motion.center_rest[j] + (1 - min(amplitude, 1.0) * lag(h, clip))[:, None] * path
    return replace(motion, position=position)


def described(
    h: Hypothesis, amplitude: np.ndarray, spread: np.ndarray, clip: Clip, base: Base,
    draws: Sequence[tuple[Hypothesis, np.ndarray]] = (),
) -> dict[str, dict]:  # fmt: skip
    """Parameters with 90 % intervals and units, as diagnosis.json has them.

    draws: the law with other numbers that would do; without them only its strength has an interval, from `spread`.
    """
    if draws:
        return _of_draws(h, amplitude, clip, draws)
    law = law_of(h, amplitude, clip)
    size = max(float(np.linalg.norm(amplitude)), 1e-30)
    share = min(1.645 * float(np.linalg.norm(spread * amplitude)) / size**2, 0.95)
    result = {}
    scaling = {
        "hidden_contact": "force", "added_mass": "mass", "tether": "stiffness", "respiration": "amplitude",
        "stiffening": "k", "fibre": "k1", "pretension": "along", "relaxation": "G", "plastic_set": "share",
        "damage": "rate", "active_contraction": "tension", "sliding_base": "cap",
    }  # fmt: skip
    by_stiffness = 1.645 * float(base.spread[0])
    for name, numbers in law.values.items():
        if name == "hidden_contact" and h.term == "added_mass":
            continue
        params = choose([name])[name].params
        for key, value in numbers.items():
            low = high = value
            if name == "gravity" and key in "xyz":
                reach = np.hypot(1.645 * spread["xyz".index(key)], by_stiffness * abs(value))
                low, high = value - reach, value + reach
            elif scaling.get(h.term) == key:
                wide = np.hypot(np.log1p(share), by_stiffness if h.term in FORCES else 0.0)
                low, high = value * np.exp(-wide), value * np.exp(wide)
            elif key == "s":
                low, high = (stiffness_of(float(amplitude[0]) * (1 + side * share)) for side in (-1, 1))
            result[key] = {
                "value": float(value),
                "low": float(min(low, high)),
                "high": float(max(low, high)),
                "unit": params[key].unit,
            }
    if h.term == "tool_slip":
        a = float(amplitude[0])
        result["slip"] = {"value": a, "low": a * (1 - share), "high": a * (1 + share), "unit": "1"}
        result["tau"] = {"value": float(h.about["tau"]), "low": 0.0, "high": 1.0, "unit": "s"}
    return result


def _of_draws(h: Hypothesis, amplitude: np.ndarray, clip: Clip, draws) -> dict[str, dict]:
    value, near = _numbers(h, amplitude, clip), [_numbers(*draw, clip) for draw in draws]
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


def _numbers(h: Hypothesis, amplitude: np.ndarray, clip: Clip) -> dict[str, tuple[float, str]]:
    """What a law's parameters are, with their units."""
    if h.term == "tool_slip":
        return {"slip": (min(float(amplitude[0]), 1.0), "1"), "tau": (float(h.about["tau"]), "s")}
    result = {}
    for name, numbers in law_of(h, amplitude, clip).values.items():
        if name == "hidden_contact" and h.term == "added_mass":
            continue
        params = choose([name])[name].params
        result |= {key: (float(value), params[key].unit) for key, value in numbers.items()}
    return result


def _plain(value):
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return None if value is None else float(value)


__all__ = ["Law", "angles", "described", "joined", "lag", "law_of", "respond"]
