"""The held base moves to and fro, as with breathing: one harmonic or two along any direction."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from surgisim.diagnosis import knobs, pushes
from surgisim.diagnosis.candidate import Candidate, Parts
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import Block, angles, spread
from surgisim.diagnosis.hypothesis import Hypothesis, ease
from surgisim.diagnosis.law import Law
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.uncertain import scaled

NAME = "respiration"
FASTEST, SLOWEST = 0.75, 0.18
"""Rates that are tried with two harmonics [1/s]; with one, up to twice the first."""
SOME = 0.7
"""Least share of a period that the fitted frames must hold."""
SETS_IN = 0.5
"""How long it takes to set in [s]."""
MAY_HURRY, MAY_TURN = 0.15, 0.5
"""How far a rate (logarithm) and a phase [rad] may be off."""


def law(h, amplitude, clip) -> Law:
    return Law({NAME: _breath(amplitude.reshape(-1, 3), h.about["rate"])}, {})


def _breath(parts: np.ndarray, rate: float) -> dict[str, float]:
    """From sine and cosine of one or two harmonics along three axes, (2, 3) or (4, 3), to one direction.

    What has a larger second harmonic than its first breathes twice as fast, without one.
    """
    scaled_parts = parts * np.array([1.0, 1.0, 0.5, 0.5])[: len(parts), None]
    left, size, right = np.linalg.svd(scaled_parts, full_matrices=False)
    s, c, s2, c2 = np.pad(left[:, 0] * size[0], (0, 4 - len(parts)))
    if math.hypot(s2, c2) > math.hypot(s, c):
        s, c, s2, c2, rate = s2, c2, 0.0, 0.0, 2 * rate
    first, second = math.hypot(s, c), math.hypot(s2, c2)
    yaw, pitch = angles(right[0])
    return {
        "amplitude": max(first, 1e-9), "period": 1 / rate, "phase": math.atan2(c, s),
        "second": second / max(first, 1e-9), "second_phase": math.atan2(c2, s2), "yaw": yaw, "pitch": pitch,
    }  # fmt: skip


def _block(look: Look, rates: Mapping[int, np.ndarray]) -> Block:
    """rates: for so many harmonics."""
    columns = look.once("base", None, lambda: pushes.of_load(look, look.base.tangent.anchored(0).T))
    at, found = pushes.times(look.clip), []
    up = ease(at / SETS_IN)
    for harmonics, some in rates.items():
        for rate in some:
            waves = []
            for n in range(1, harmonics + 1):
                turn = 2 * np.pi * n * rate * at
                waves += [up * np.sin(turn) / n, up * (np.cos(turn) - 1) / n]
            mix = np.concatenate([spread(w) for w in waves], 1)
            found.append(Hypothesis(NAME, mix, 0, None, about={"rate": rate}))
    return Block(columns, found)


def tried(look: Look) -> Parts:
    if look.clip.body.held.any():
        last = pushes.times(look.clip)[-1]
        slowest = max(SLOWEST, SOME / last)
        # A sine needs half as many numbers, and pays less for them.
        rates = {1: np.geomspace(slowest, 2 * FASTEST, 20), 2: np.geomspace(slowest, FASTEST, 14)}
        yield "breathing", lambda: iter([_block(look, rates)])


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    # A rate off by two parts in a hundred is out of step by the time of the frames held out.
    reach = 0.12 if step == 1 else 0.02
    harmonics = h.mix.shape[1] // 6
    yield _block(look, {harmonics: h.about["rate"] * np.exp(reach * np.linspace(-1, 1, 13))})


def _later(amplitude: np.ndarray, angle: float) -> np.ndarray:
    """The same breath, its phase further by an angle [rad]; amplitude: (6,) or (12,)."""
    parts = amplitude.reshape(-1, 2, 3)
    turns = [[[np.cos(n * angle), -np.sin(n * angle)], [np.sin(n * angle), np.cos(n * angle)]]
             for n in range(1, len(parts) + 1)]  # fmt: skip
    return (np.array(turns) @ parts).ravel()


def _faster(h: Hypothesis, amplitude: np.ndarray, by: float, clip: Clip) -> knobs.Start:
    """Of another rate, in step with the old one in the middle of the fitted frames."""
    rate, middle = h.about["rate"] * float(np.exp(MAY_HURRY * by)), clip.time[clip.until - 1] / 2
    amplitude = _later(amplitude, -2 * np.pi * (rate - h.about["rate"]) * middle)
    return replace(h, about={**h.about, "rate": rate}), amplitude


def _aside(which: int) -> knobs.Knob:
    """Along another direction, turned about one of the two axes across its own."""

    def turn(h, amplitude, by, clip):
        parts = amplitude.reshape(-1, 3)
        own = np.linalg.svd(parts, full_matrices=True)[2]
        a, b = own[0], own[which]
        angle = knobs.TURN * by
        by_turn = np.eye(3) + (np.cos(angle) - 1) * (np.outer(a, a) + np.outer(b, b))
        by_turn += np.sin(angle) * (np.outer(b, a) - np.outer(a, b))
        return h, (parts @ by_turn.T).ravel()

    return knobs.Knob(turn)


def turned(h: Hypothesis, amplitude: np.ndarray) -> list[knobs.Knob]:
    phase = knobs.Knob(lambda h, a, by, clip: (h, _later(a, MAY_TURN * by)))
    return [*knobs.strength(h, amplitude), knobs.Knob(_faster), phase, _aside(1), _aside(2)]


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    finer=finer,
    knobs=turned,
    interval=scaled("amplitude"),
    seen="the base moves to and fro, touched or not, as with breathing",
    added="a moving base ({amount})",
)
