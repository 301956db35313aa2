"""Tissue that resists a load otherwise than the base: all along, from a moment on, or more the more it is strained."""

from collections.abc import Iterator, Sequence

import numpy as np

from surgisim.diagnosis import knobs
from surgisim.diagnosis.candidate import Candidate, Parts, stronger
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.law import Law, placed
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.residual import courses
from surgisim.diagnosis.residual.courses import BEFORE
from surgisim.diagnosis.residual.strengths import each
from surgisim.diagnosis.scopes import EVERYWHERE, Where, around, blobs, here, layers
from surgisim.diagnosis.stresses import at_states, gradients
from surgisim.diagnosis.tangent import piola
from surgisim.physics.catalogue import choose
from surgisim.physics.terms.residual_stiffness import here_at

NAME = "residual_stiffness"
NUMBERS = ("shear", "bulk", "strained")
KINDS = {"shear": (0,), "bulk": (1,), "both": (0, 1), "strained": (2,)}
"""Which numbers a form has."""
WIDTHS = (0.05, 0.2)
"""Squared strains over which stiffness changes with strain [1]."""
DEPTHS = (0.3,)
"""Shares of the depth below the observed side at which blobs are tried."""
RISE = 0.15
"""How long a change from a moment on is tried to take [s]."""


def law(h, amplitude, clip) -> Law:
    numbers = dict.fromkeys(NUMBERS, 0.0)
    for k, a in zip(KINDS[h.about["kind"]], amplitude, strict=True):
        numbers[NUMBERS[k]] = float(a)
    onset = BEFORE if h.onset is None else h.onset
    own = {"width": h.about["width"], "onset": float(onset), "rise": h.about["rise"]}
    return Law({NAME: {**numbers, **own}}, placed(h, NAME))


def _states(look: Look, where: Where, kind: int, width: float) -> np.ndarray:
    """What one unit of a number does at the tangent's states [m/Pa], (S, K, 3)."""
    numbers = {name: float(n == kind) for n, name in enumerate(NUMBERS)}
    row = {**numbers, "width": width, "onset": BEFORE, "rise": RISE}
    term = choose([NAME])[NAME]
    stresses = look.once(
        f"residual stiffness {kind} {width}", None, lambda: np.stack([piola(term, F, row) for F in gradients(look)])
    )
    return at_states(look, stresses, where.weight(look.rest)[None])[0]


def _onsets(clip: Clip) -> list[float]:
    last = (clip.until - 1) / clip.fps
    return [float(o) for o in np.arange(courses.MOMENT, 0.92 * last, courses.MOMENT)]


def _always(look: Look, wheres: Sequence[Where], kinds: Sequence[str], widths: Sequence[float]) -> Block:
    near, columns, found = look.base.tangent, [], []
    for where in wheres:
        for kind in kinds:
            for width in widths if kind == "strained" else widths[:1]:
                start = len(columns)
                columns += [near.over_time(_states(look, where, k, width)) for k in KINDS[kind]]
                about = {"kind": kind, "width": float(width), "rise": RISE}
                found.append((where, start, len(KINDS[kind]), about))
    eye = np.eye(len(columns))
    return Block(
        np.stack(columns),
        [Hypothesis(NAME, eye[:, s : s + n], 0, w.place, about=a, scope=w.scope) for w, s, n, a in found],
    )


def _from_a_moment(look: Look, where: Where, kinds: Sequence[str], onsets: Sequence[float], rise: float) -> Block:
    near, time = look.base.tangent, look.clip.time[: look.clip.until]
    shapes = [here_at(time, onset, rise) for onset in onsets]
    columns = [near.over_time(_states(look, where, k, WIDTHS[0]), shape) for k in (0, 1) for shape in shapes]
    eye, found = np.eye(len(columns)), []
    for kind in kinds:
        about = {"kind": kind, "width": WIDTHS[0], "rise": rise}
        for n, onset in enumerate(onsets):
            mine = [n + k * len(onsets) for k in KINDS[kind]]
            found.append(Hypothesis(NAME, eye[:, mine], 0, where.place, onset, None, about, where.scope))
    return Block(np.stack(columns), found)


def tried(look: Look) -> Parts:
    wheres = [EVERYWHERE, *layers(look), *blobs(look, DEPTHS)]
    yield "other stiffness", lambda: iter([_always(look, wheres, [*KINDS], WIDTHS)])
    for n, where in enumerate(wheres):
        yield (
            f"stiffness from a moment on, {where.scope} {n}",
            lambda w=where: iter([_from_a_moment(look, w, ("shear", "both"), _onsets(look.clip), RISE)]),
        )


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    kind, width = h.about["kind"], h.about["width"]
    places = around(look, h, step)
    if h.onset is None:
        widths = width * np.exp(0.7 * step * np.array([-1.0, 0.0, 1.0])) if kind == "strained" else [width]
        yield _always(look, [here(h)], [kind], widths)
        if places:
            yield _always(look, places, [kind], [width])
        return
    onsets = h.onset + step * courses.MOMENT * np.array([-0.5, -0.25, 0.0, 0.25, 0.5])
    yield _from_a_moment(look, here(h), [kind], onsets.tolist(), h.about["rise"])
    for where in places:
        yield _from_a_moment(look, where, [kind], [h.onset], h.about["rise"])


def turned(h: Hypothesis, amplitude: np.ndarray) -> list[knobs.Knob]:
    own = [knobs.logarithm("width", 0.7)] if h.about["kind"] == "strained" else []
    rise = [] if h.onset is None else [knobs.logarithm("rise", 0.5)]
    return [*knobs.amplitudes(h, amplitude), *knobs.place(h), *knobs.moment(h, "onset"), *own, *rise]


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    finer=finer,
    knobs=turned,
    interval=each(NUMBERS),
    beside=stronger,
    seen="the tissue {where} resists otherwise than around it",
    added="another stiffness there ({amount})",
)
