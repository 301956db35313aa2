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
DEPTHS = (0.35,)
"""Shares of the depth below the observed side at which blobs are tried."""


def law(h, amplitude, clip) -> Law:
    components = KINDS[h.about["kind"]] @ amplitude
    stress = {axis: float(s) for axis, s in zip(AXES, components, strict=True)}
    return Law({NAME: {**stress, **courses.of(h).numbers}}, placed(h, NAME))


def _states(look: Look, where: Where) -> np.ndarray:
    """What one pascal of each component does at the tangent's states [m/Pa], (6, S, K, 3)."""
    share = where.weight(look.rest)[None]
    return np.stack([at_states(look, gradients(look) @ tensor(*axis), share)[0] for axis in np.eye(6)])


def _coarse(look: Look, where: Where) -> Block:
    near, bases = look.base.tangent, courses.bases(look.clip)
    columns = np.stack([near.over_time(states, course) for states in _states(look, where) for course in bases])
    found = [
        _hypothesis(mix, where, course, kind)
        for kind, parts in KINDS.items()
        for course, mix in courses.spread(courses.tried(look.clip), look.clip, parts)
    ]
    return Block(columns, found)


def _exact(look: Look, tried: Sequence[tuple[Where, Course]], kind: str) -> Block:
    near, parts, columns, found = look.base.tangent, KINDS[kind].T, [], []
    eye = np.eye(len(parts) * len(tried))
    for where, course in tried:
        states = look.once("residual stress", where, lambda w=where: _states(look, w))
        shape, first = courses.exactly(course, look.clip), len(columns)
        columns += [near.over_time(np.tensordot(part, states, 1), shape) for part in parts]
        found.append(_hypothesis(eye[:, first : len(columns)], where, course, kind))
    return Block(np.stack(columns), found)


def _hypothesis(mix: np.ndarray, where: Where, course: Course, kind: str) -> Hypothesis:
    return Hypothesis(NAME, mix, 0, where.place, course.onset, course.end, {**course.about, "kind": kind}, where.scope)


def tried(look: Look) -> Parts:
    for n, where in enumerate((EVERYWHERE, *layers(look), *blobs(look, DEPTHS))):
        yield f"stresses, {where.scope} {n}", lambda w=where: iter([_coarse(look, w)])


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    kind, course = h.about["kind"], courses.of(h)
    yield _exact(look, [(here(h), other) for other in courses.near(course, step)], kind)
    if h.place is not None:
        yield _exact(look, [(where, course) for where in around(look, h, step)], kind)


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
