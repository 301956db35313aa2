"""Tissue that strains by itself, in a blob, a layer or everywhere, in a course that time alone decides.

A pressure, equal along all axes, is tried beside all six components of a stress: where it says as much, it has fewer
numbers.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from surgisim.diagnosis import knobs
from surgisim.diagnosis.candidate import Candidate, Parts, stronger
from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.law import Law, placed
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.residual import courses
from surgisim.diagnosis.residual.courses import Course
from surgisim.diagnosis.residual.strengths import each
from surgisim.diagnosis.scopes import EVERYWHERE, Where, around, blobs, here, layers
from surgisim.diagnosis.stresses import at_states, gradients
from surgisim.physics.terms.residual_stress import AXES, tensor

NAME = "residual_stress"
KINDS = {"pressure": np.array([[1.0], [1.0], [1.0], [0.0], [0.0], [0.0]]), "full": np.eye(6)}
"""From amplitudes to components."""
DEPTHS = (0.2, 0.55)
"""Shares of the depth below the observed side at which blobs are tried."""


def law(h, amplitude, clip) -> Law:
    components = KINDS[h.about["kind"]] @ amplitude
    stress = {axis: float(s) for axis, s in zip(AXES, components, strict=True)}
    return Law({NAME: {**stress, **courses.of(h).numbers}}, placed(h, NAME))


def _block(look: Look, where: Where, tried: Sequence[Course], kinds: Sequence[str]) -> Block:
    share = where.weight(look.rest)[None]

    def columns() -> np.ndarray:
        units = [tensor(*axis) for axis in np.eye(6)]
        states = [at_states(look, gradients(look) @ unit, share)[0] for unit in units]
        bases = courses.bases(look.clip)
        return np.stack([look.base.tangent.over_time(s, course) for s in states for course in bases])

    found = [
        Hypothesis(NAME, mix, 0, where.place, c.onset, c.end, {**c.about, "kind": kind}, where.scope)
        for kind in kinds
        for c, mix in courses.spread(tried, look.clip, KINDS[kind])
    ]
    return Block(look.once("residual stress", where, columns), found)


def tried(look: Look) -> Parts:
    for where in (EVERYWHERE, *layers(look), *blobs(look, DEPTHS)):
        yield f"stresses, {where.scope}", lambda w=where: iter([_block(look, w, courses.tried(look.clip), [*KINDS])])


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    kinds, course = [h.about["kind"]], courses.of(h)
    yield _block(look, here(h), list(courses.near(course, step)), kinds)
    for where in around(look, h, step):
        yield _block(look, where, [course], kinds)


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    finer=finer,
    knobs=lambda h, a: [*knobs.amplitudes(h, a), *knobs.place(h), *courses.free(h)],
    interval=each(AXES),
    beside=stronger,
    seen="the tissue {where} strains by itself",
    added="a stress there ({amount})",
)
