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


def _states(look: Look, place: Place) -> np.ndarray:
    """What one newton along x, y and z does at the tangent's states [m/N], (S, 3, K, 3)."""
    near = look.base.tangent
    loads = near.of_push(pushes.weight(look, place)[None, :, None] * np.eye(3)[:, None])
    return near.at_states(np.broadcast_to(loads, (len(near.frames), *loads.shape)))


def _coarse(look: Look, place: Place) -> Block:
    near, states, bases = look.base.tangent, _states(look, place), courses.bases(look.clip)
    columns = np.stack([near.over_time(states[:, d], course) for d in range(3) for course in bases])
    mixes = courses.spread(courses.tried(look.clip), look.clip, np.eye(3))
    return Block(columns, [_hypothesis(mix, place, course) for course, mix in mixes])


def _exact(look: Look, tried: Sequence[tuple[Place, Course]]) -> Block:
    near, columns, found = look.base.tangent, [], []
    for n, (place, course) in enumerate(tried):
        states = look.once("residual push", place, lambda p=place: _states(look, p))
        shape = courses.exactly(course, look.clip)
        columns += [near.over_time(states[:, d], shape) for d in range(3)]
        found.append(_hypothesis(np.eye(3 * len(tried))[:, 3 * n : 3 * n + 3], place, course))
    return Block(np.stack(columns), found)


def _hypothesis(mix: np.ndarray, place: Place, course: Course) -> Hypothesis:
    return Hypothesis(NAME, mix, 0, place, course.onset, course.end, course.about, "blob")


def tried(look: Look) -> Parts:
    for part, place in pushes.places(look):
        yield part, lambda p=place: iter([_coarse(look, p)])


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    yield _exact(look, [(h.place, course) for course in courses.near(courses.of(h), step)])
    yield _exact(look, [(place, courses.of(h)) for place in pushes.around(look, h, step)])


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
