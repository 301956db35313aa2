"""Something heavy comes to lie on the tissue, or turns up in it: it pulls down from one moment on."""

from collections.abc import Iterator

import numpy as np

from surgisim.diagnosis import knobs, pushes
from surgisim.diagnosis.candidate import Candidate, Parts, stronger
from surgisim.diagnosis.form import Block, moments, spread
from surgisim.diagnosis.hypothesis import RISE, Hypothesis, ease
from surgisim.diagnosis.law import Law
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.uncertain import scaled
from surgisim.physics.place import Place

NAME, WEIGHT = "added_mass", "hidden_contact"
"""The term that is heavy, and the one that pulls it down where a recording's gravity is already balanced."""


def law(h, amplitude, clip) -> Law:
    pull = light(h, amplitude, clip)
    mass = {"mass": abs(float(amplitude[0])) / 9.81}
    return Law({NAME: mass, **pull.values}, {NAME: h.place, **pull.places})


def light(h, amplitude, clip) -> Law:
    """Its pull alone."""
    pull = pushes.push(float(amplitude[0]) * h.about["down"], h.onset, None)
    return Law({WEIGHT: pull}, {WEIGHT: h.place})


def _block(look: Look, place: Place, begins: np.ndarray) -> Block:
    at, down = pushes.times(look.clip), pushes.down(look.clip)
    courses = [(onset, ease((at - onset) / RISE)) for onset in begins if onset >= 0]
    found = [
        Hypothesis(NAME, spread(course) @ down[:, None], 1, place, onset, None, {"down": down}, "blob")
        for onset, course in courses
        if course.any()
    ]
    return Block(pushes.columns(look, place), found)


def tried(look: Look) -> Parts:
    for part, place in pushes.places(look):
        yield part, lambda p=place: iter([_block(look, p, moments(look.clip))])


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    for place in pushes.around(look, h, step):
        yield _block(look, place, h.onset + step * pushes.SHIFTS)


CANDIDATE = Candidate(
    law=law,
    light=light,
    tried=tried,
    finer=finer,
    knobs=lambda h, a: [*knobs.strength(h, a), *knobs.place(h), *knobs.moment(h, "onset")],
    interval=scaled("mass", over_stiffness=True),
    beside=stronger,
    unsaid=(WEIGHT,),
    seen="the tissue sags {where} from {onset} on, as under a load",
    added="a weight there ({amount})",
)
