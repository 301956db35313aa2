"""Strands along one direction of the tissue's plane resist being stretched, everywhere or in some of it."""

from collections.abc import Iterator

import numpy as np

from surgisim.diagnosis import knobs
from surgisim.diagnosis.candidate import Candidate, Parts, stronger
from surgisim.diagnosis.form import Block, angles, plane
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.law import Law, placed
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.scopes import EVERYWHERE, Where, around, blobs, here, layers
from surgisim.diagnosis.stresses import block, followed
from surgisim.diagnosis.tangent import piola
from surgisim.diagnosis.uncertain import scaled
from surgisim.physics.catalogue import choose

NAME = "fibre"
TURNS, TURNS_HERE = 12, 4
"""Directions that are tried everywhere, and in some of the tissue."""
GROWS = 0.2
"""Exponent k2 that is tried."""
FINER = (0.05, 0.2, 0.5, 1.5)
"""The same, when a hypothesis is sharpened."""


def law(h, amplitude, clip) -> Law:
    yaw, pitch = angles(h.about["axis"])
    own = {"k1": float(amplitude[0]), "k2": h.about["k2"], "yaw": yaw, "pitch": pitch}
    return Law({NAME: own}, placed(h, NAME))


def _block(look: Look, wheres: list[Where], turns: np.ndarray, grows: tuple[float, ...] = (GROWS,)) -> Block:
    term, (u, v) = choose([NAME])[NAME], plane(look.clip)
    columns, found = [], []
    for turn in turns:
        for k2 in grows:
            a = np.cos(turn) * u + np.sin(turn) * v
            row = {"k1": 1.0, "k2": k2, "x": a[0], "y": a[1], "z": a[2]}
            columns.append(followed(look, lambda F, r=row: piola(term, F, r), wheres))
            found.append({"k2": k2, "axis": a, "turn": turn})
    return block(NAME, columns, wheres, 1, found)


def tried(look: Look) -> Parts:
    def make() -> Iterator[Block]:
        yield _block(look, [EVERYWHERE], np.arange(TURNS) * np.pi / TURNS)
        yield _block(look, [*layers(look), *blobs(look)], np.arange(TURNS_HERE) * np.pi / TURNS_HERE)

    yield "strands", make


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    apart = np.pi / (TURNS if h.place is None else TURNS_HERE)
    turns = h.about["turn"] + np.array([-0.5, 0.0, 0.5]) * step * apart
    yield _block(look, [here(h)], turns, FINER)
    if h.place is not None:
        yield _block(look, around(look, h, step), turns[1:2], (h.about["k2"],))


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    finer=finer,
    knobs=lambda h, a: [*knobs.strength(h, a), *knobs.place(h), knobs.logarithm("k2", 1.0), knobs.turn("axis")],
    interval=scaled("k1", over_stiffness=True),
    beside=stronger,
    seen="the tissue {where} resists being stretched along one direction",
    added="strands in that direction ({amount})",
)
