"""A grip gives way along its path: tissue stays behind by a share that grows from one moment on."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from surgisim.artifacts.motion import Motion
from surgisim.diagnosis import knobs
from surgisim.diagnosis.answers import Answers
from surgisim.diagnosis.candidate import Candidate, Numbers, Parts
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.law import Law
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.uncertain import Spread
from surgisim.physics.place import Place

NAME = "tool_slip"
TAUS = (0.05, 0.15, 0.35, 0.7)
"""How long a slip takes that is tried [s]."""


def law(h, amplitude, clip) -> Law:
    return Law({}, {}, _slipped(clip, h, float(amplitude[0])))


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


def tried(look: Look) -> Parts:
    if len(look.clip.motion.radius):
        yield "slipping grips", lambda: _slipping(look)


def _slipping(look: Look) -> Iterator[Block]:
    clip, near = look.clip, look.base.tangent
    motion, until = clip.motion, clip.until
    for j in range(len(motion.radius)):
        active = motion.active[j, :until]
        if not active.any():
            continue
        loads = near.anchored(1 + j).T
        states = near.at_states(np.broadcast_to(loads, (len(near.frames), *loads.shape)))
        path = np.where(active[:, None], motion.position[j, :until] - motion.center_rest[j], 0.0)
        back = -path.T
        time, length = clip.time[:until], np.linalg.norm(path, axis=1)
        # A share lost from the start is how firmly the grid carries a grip (nuisance.grips), not a slip.
        begin, last = time[np.argmax(length > 0.3 * length.max())], time[active][-1]
        courses, found = [], []
        for onset in np.linspace(begin, last - 0.15, 12):
            for tau in TAUS:
                late = np.maximum(time - onset, 0) / tau
                courses.append(back * (1 - np.exp(-late)) ** 2)
                found.append((onset, {"tau": tau, "grip": j}))
            start = np.interp(onset, time, length)
            course = np.where(
                (time > onset) & (length > 0), np.maximum(length - start, 0) / np.maximum(length, 1e-9), 0
            )
            if course.max() > 0.05:
                courses.append(back * course)
                found.append((onset, {"tau": 0.0, "grip": j}))
        place = Place(tuple(motion.center_rest[j]), float(motion.radius[j]))
        eye = np.eye(len(courses))
        yield Block(
            Answers(states.swapaxes(0, 1), near.share, np.stack(courses)),
            [Hypothesis(NAME, eye[:, k : k + 1], 1, place, t, last, a, "grip") for k, (t, a) in enumerate(found)],
        )


def numbers(h: Hypothesis, amplitude: np.ndarray) -> Numbers:
    return {"slip": (min(float(amplitude[0]), 1.0), "1"), "tau": (float(h.about["tau"]), "s")}


def modelled(h: Hypothesis, amplitude: np.ndarray) -> dict[str, dict[str, float]]:
    return {NAME: {"slip": min(float(amplitude[0]), 1.0), "onset": float(h.onset)}}


def interval(key: str, value: float, spread: Spread) -> tuple[float, float]:
    if key == "slip":
        return value * (1 - spread.share), value * (1 + spread.share)
    return 0.0, max(value, 1.0)


def turned(h: Hypothesis, amplitude: np.ndarray) -> list[knobs.Knob]:
    tau = [knobs.logarithm("tau", 0.7)] if h.about["tau"] > 0 else []
    return [*knobs.strength(h, amplitude), *knobs.moment(h, "onset"), *tau]


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    knobs=turned,
    interval=interval,
    numbers=numbers,
    modelled=modelled,
    seen="the tissue follows the instrument less and less from {onset} on",
    added="a grip that slips ({amount})",
    exact_extent=True,
)
