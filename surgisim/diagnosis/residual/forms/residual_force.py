"""A push at a place, in a course that time alone decides."""

from collections.abc import Iterator, Sequence

import numpy as np

from surgisim.diagnosis import knobs, pushes
from surgisim.diagnosis.candidate import Candidate, Parts, stronger
from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.law import Law
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.residual import courses
from surgisim.diagnosis.residual.courses import Course
from surgisim.diagnosis.residual.strengths import each
from surgisim.physics.place import Place

NAME = "residual_force"
AXES = ("x", "y", "z")


def law(h, amplitude, clip) -> Law:
    force = {axis: float(a) for axis, a in zip(AXES, amplitude, strict=True)}
    return Law({NAME: {**force, **courses.of(h).numbers}}, {NAME: h.place})


def _block(look: Look, place: Place, tried: Sequence[Course]) -> Block:
    near = look.base.tangent

    def columns() -> np.ndarray:
        loads = near.of_push(pushes.weight(look, place)[None, :, None] * np.eye(3)[:, None])
        states = near.at_states(np.broadcast_to(loads, (len(near.frames), *loads.shape)))
        return np.stack([near.over_time(states[:, d], c) for d in range(3) for c in courses.bases(look.clip)])

    mixes = courses.spread(tried, look.clip, np.eye(3))
    found = [Hypothesis(NAME, mix, 0, place, c.onset, c.end, c.about, "blob") for c, mix in mixes]
    return Block(look.once("residual push", place, columns), found)


def tried(look: Look) -> Parts:
    for part, place in pushes.places(look):
        yield part, lambda p=place: iter([_block(look, p, courses.tried(look.clip))])


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    yield _block(look, h.place, list(courses.near(courses.of(h), step)))
    for place in pushes.around(look, h, step):
        yield _block(look, place, [courses.of(h)])


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    finer=finer,
    knobs=lambda h, a: [*knobs.amplitudes(h, a), *knobs.place(h), *courses.free(h)],
    interval=each(AXES),
    beside=stronger,
    seen="something pushes the tissue {where}",
    added="a force there ({amount})",
)
