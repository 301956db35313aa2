"""Tissue pulls by itself again and again, everywhere or in some of it: all in phase, or as a wave that travels.

A standing pull is tried everywhere, in layers and in blobs; a travelling one everywhere and in layers: within a blob,
a fraction of a wavelength wide, the two are one. Standing pulls along all directions of the plane are mixes of three
threads, all phases of a period mixes of four columns (waves.py).
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from surgisim.diagnosis import knobs, waves
from surgisim.diagnosis.answers import side_by_side
from surgisim.diagnosis.candidate import Candidate, Parts, stronger
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import Block, angles, plane, scale
from surgisim.diagnosis.hypothesis import SETS_IN, Hypothesis
from surgisim.diagnosis.law import Law, placed
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.scopes import EVERYWHERE, Where, around, blobs, here, layers
from surgisim.diagnosis.stresses import at_states, gradients
from surgisim.diagnosis.uncertain import scaled

NAME = "active_contraction"
TURNS, TURNS_HERE = 12, 6
"""Directions of a wave that travels everywhere, over a turn; and in a layer."""
TURNS_STANDING = 4
"""Directions of a pull that stands, over half a turn."""
PERIODS = (0.8, 1.0, 1.25, 1.6, 2.0)
"""[s]"""
DUTIES = (0.5, 1.0)
"""Share of a period in which tissue pulls: it rests for half of it, or swells and sinks without a rest."""
MAY_LAST = 0.2
"""How far that may be off (logarithm)."""
WAVES, WAVES_HERE = (0.024, 0.045), (0.035,)
"""Wavelengths tried everywhere and in a layer [m], for a body of 36 mm; they follow the body's size."""
PHASES = tuple(np.arange(6) * 2 * np.pi / 6)
STARTS = (0.0, 0.4, 0.8, 1.3)
"""When a rhythm may set in, after where the coarse search has it, when it is sharpened [s]."""
THREADS = np.arange(3) * np.pi / 3
STANDS = np.inf
"""Wavelength of what is all in phase."""
MAY_SLOW, MAY_TURN = 0.15, 0.7
"""How far a period (logarithm) and a phase [rad] may be off."""


def law(h, amplitude, clip) -> Law:
    """Counted from long before every part's first pull; `begin` is when the rhythm sets in."""
    yaw, pitch = angles(h.about["axis"])
    period, slowness = h.about["period"], h.about["period"] / h.about["wavelength"]
    onset = -h.about["phase"] / (2 * np.pi) * period
    along = clip.body.rest.astype(float) @ np.asarray(h.about["axis"], float)
    onset -= period * math.ceil((onset + slowness * (along.max() - along.mean())) / period)
    rhythm = {
        "onset": onset,
        "period": period,
        "duty": h.about["duty"],
        "slowness": slowness,
        "begin": h.onset + SETS_IN / 2,
    }
    return Law({NAME: {"tension": float(amplitude[0]), **rhythm, "yaw": yaw, "pitch": pitch}}, placed(h, NAME))


def tried(look: Look) -> Parts:
    size = scale(look.clip)

    def travelling(where: Where, count: int, lengths: Sequence[float]) -> Iterator[Block]:
        for turn in np.arange(count) * 2 * np.pi / count:
            yield from _travelling(look, where, turn, size * np.array(lengths), PERIODS, PHASES)

    def standing() -> Iterator[Block]:
        turns = np.arange(TURNS_STANDING) * np.pi / TURNS_STANDING
        return _standing(look, [EVERYWHERE, *layers(look), *blobs(look)], turns, PERIODS, PHASES)

    yield "waves of contraction", lambda: travelling(EVERYWHERE, TURNS, WAVES)
    for where in layers(look):
        yield "waves of contraction in a layer", lambda w=where: travelling(w, TURNS_HERE, WAVES_HERE)
    yield "contractions", standing


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    b, near = h.about, step * np.array([-0.5, 0.0, 0.5])
    starts = sorted({0.0, b["start"], *(b["start"] + s for s in STARTS)}) if step == 1 else [b["start"]]
    periods, phases = b["period"] * np.exp(0.18 * near), b["phase"] + near * np.pi / 3
    if np.isinf(b["wavelength"]):
        turns = b["turn"] + near * np.pi / TURNS_STANDING
        yield from _standing(look, [here(h)], turns, periods, phases, starts, (b["duty"],))
        yield from _standing(
            look, around(look, h, step), [b["turn"]], [b["period"]], phases, [b["start"]], (b["duty"],)
        )
        return
    for turn in b["turn"] + near * 2 * np.pi / TURNS:
        lengths = b["wavelength"] * np.exp(0.5 * near)
        yield from _travelling(look, here(h), turn, lengths, periods, phases, starts, (b["duty"],))
    for where in around(look, h, step):
        only = [b["wavelength"]], [b["period"]], phases, [b["start"]], (b["duty"],)
        yield from _travelling(look, where, b["turn"], *only)


def _axis(look: Look, turn: float) -> np.ndarray:
    u, v = plane(look.clip)
    return np.cos(turn) * u + np.sin(turn) * v


def _pulled(look: Look, axis: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """What a tension of 1 Pa along an axis does, for shares of it (Q, P) [m/Pa], (Q, S, K, 3)."""
    Fa = gradients(look) @ axis
    return at_states(look, Fa[..., :, None] * axis, shares)


def _travelling(
    look: Look, where: Where, turn: float, lengths: Sequence[float], periods, phases, starts=(0.0,), duties=DUTIES
) -> Iterator[Block]:
    axis, weight = _axis(look, turn), where.weight(look.rest)
    for length in lengths:
        states = _pulled(look, axis, weight * waves.patterns(look, axis, length))
        for start in starts:
            form = (axis, length, turn, start)
            found = [*_hypotheses(where, form, periods, phases, duties, lambda mix: mix)]
            yield Block(waves.columns(look, states, periods, start), found)


def _standing(
    look: Look, wheres: Sequence[Where], turns, periods, phases, starts=(0.0,), duties=DUTIES
) -> Iterator[Block]:
    if not len(wheres):
        return
    shares = np.stack([w.weight(look.rest) for w in wheres])
    states = [_pulled(look, _axis(look, thread), shares) for thread in THREADS]
    for (q, where), start in itertools.product(enumerate(wheres), starts):
        columns = side_by_side([waves.columns(look, mine[q : q + 1], periods, start) for mine in states])
        found = []
        for turn in turns:
            form, threads = (_axis(look, turn), STANDS, turn, start), _threads(turn)
            found += _hypotheses(where, form, periods, phases, duties, lambda mix, by=threads: np.kron(by, mix))
        yield Block(columns, found)


def _threads(turn: float) -> np.ndarray:
    """A pull along one direction of the plane by pulls along the three threads, (3,)."""
    c, s = np.cos(THREADS), np.sin(THREADS)
    a, b = np.cos(turn), np.sin(turn)
    return np.linalg.solve(np.stack([c * c, c * s, s * s]), [a * a, a * b, b * b])


def _hypotheses(where: Where, form: tuple, periods, phases, duties, mixed) -> Iterator[Hypothesis]:
    axis, length, turn, start = form
    for (n, period), phase, duty in itertools.product(enumerate(periods), phases, duties):
        about = {
            "period": period, "duty": duty, "wavelength": length, "axis": axis, "phase": phase, "turn": turn,
            "start": start,
        }  # fmt: skip
        mix = mixed(waves.mix(periods, n, phase, duty))[:, None]
        yield Hypothesis(NAME, mix, 1, where.place, start, None, about, where.scope)


def _slower(h: Hypothesis, amplitude: np.ndarray, by: float, clip: Clip) -> knobs.Start:
    """Of another period, in step with the old one in the middle of the fitted frames."""
    period, middle = h.about["period"] * float(np.exp(MAY_SLOW * by)), clip.time[clip.until - 1] / 2
    phase = h.about["phase"] + 2 * np.pi * middle * (1 / h.about["period"] - 1 / period)
    return replace(h, about={**h.about, "period": period, "phase": phase}), amplitude


def turned(h: Hypothesis, amplitude: np.ndarray) -> list[knobs.Knob]:
    travels = [] if np.isinf(h.about["wavelength"]) else [knobs.logarithm("wavelength", 0.4)]
    lasts = knobs.logarithm("duty", MAY_LAST, 1.0)
    rhythm = [knobs.Knob(_slower), lasts, *travels, knobs.turn("axis"), knobs.plus("phase", MAY_TURN)]
    return [*knobs.strength(h, amplitude), *knobs.place(h), *knobs.moment(h, "onset"), *rhythm]


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    finer=finer,
    knobs=turned,
    interval=scaled("tension", over_stiffness=True),
    beside=stronger,
    seen="the tissue {where} contracts by itself, in waves",
    added="muscle that pulls ({amount})",
)
