"""Tissue that is taut at rest, in any two directions of its plane: it resists bending and lifting."""

import math
from collections.abc import Iterator

import numpy as np

from surgisim.diagnosis import knobs
from surgisim.diagnosis.candidate import Candidate, Parts, stronger
from surgisim.diagnosis.form import Block, angles, plane
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.law import Law, placed
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.scopes import EVERYWHERE, Where, around, blobs, here, layers
from surgisim.diagnosis.stresses import followed
from surgisim.diagnosis.tangent import piola
from surgisim.diagnosis.uncertain import scaled
from surgisim.physics.catalogue import choose
from surgisim.physics.heading import across_of

NAME = "pretension"
GROWS, GROWS_HERE = (-1.0, 1.0), (0.0,)
"""How tension goes with stretch, tried everywhere and in some of the tissue."""
MAY_GROW = 0.7
"""How far that exponent may be off [1]."""
AXES = ("ax", "ay", "az", "bx", "by", "bz")
THREADS = np.arange(3) * np.pi / 3
"""Three threads a third of a half turn apart make any tension of the plane."""


def law(h, amplitude, clip) -> Law:
    return Law({NAME: {**_tension(amplitude, h.about["plane"]), "grows": h.about["grows"]}}, placed(h, NAME))


def _tension(amplitude: np.ndarray, plane: np.ndarray) -> dict[str, float]:
    """From threads in a plane, (3,), to the tensions along its two main directions."""
    axes = np.stack([np.cos(THREADS), np.sin(THREADS)], 1)
    values, vectors = np.linalg.eigh(np.einsum("h,hi,hj->ij", amplitude, axes, axes))
    a, b = vectors[:, 1] @ plane, vectors[:, 0] @ plane
    yaw, pitch = angles(a)
    right, down = across_of(yaw, pitch)
    along, across = max(float(values[1]), 1e-6), max(float(values[0]), 0.0)
    return {"along": along, "across": across, "yaw": yaw, "pitch": pitch, "roll": math.atan2(b @ down, b @ right)}


def _block(look: Look, wheres: list[Where], exponents: tuple[float, ...]) -> Block:
    term, (u, v) = choose([NAME])[NAME], plane(look.clip)
    columns, found = [], []
    for grows in exponents:
        first = len(columns) * len(wheres)
        for turn in THREADS:
            a = np.cos(turn) * u + np.sin(turn) * v
            axes = dict(zip(AXES, (*a, *np.cross(a, look.clip.normal)), strict=True))
            row = {"along": 1.0, "across": 0.0, "grows": grows, **axes}
            columns.append(followed(look, lambda F, r=row: piola(term, F, r), wheres))
        about = {"plane": np.stack([u, v]), "grows": grows}
        found += [(first + q + len(wheres) * np.arange(len(THREADS)), w, about) for q, w in enumerate(wheres)]
    eye = np.eye(len(columns) * len(wheres))
    return Block(
        np.concatenate(columns),
        [Hypothesis(NAME, eye[:, k], 0, w.place, about=about, scope=w.scope) for k, w, about in found],
    )


def tried(look: Look) -> Parts:
    def make() -> Iterator[Block]:
        yield _block(look, [EVERYWHERE], GROWS)
        yield _block(look, [*layers(look), *blobs(look)], GROWS_HERE)

    yield "tensions at rest", make


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    grows = h.about["grows"]
    yield _block(look, [here(h)], tuple({float(np.clip(grows + step * by, -1, 1)) for by in (-1.0, 0.0, 1.0)}))
    if h.place is not None:
        yield _block(look, around(look, h, step), (grows,))


def turned(h: Hypothesis, amplitude: np.ndarray) -> list[knobs.Knob]:
    grows = knobs.plus("grows", MAY_GROW, low=-1.0, high=1.0)
    return [*knobs.amplitudes(h, amplitude), *knobs.place(h), grows]


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    finer=finer,
    knobs=turned,
    interval=scaled("along", over_stiffness=True),
    beside=stronger,
    seen="the tissue {where} resists bending and lifting as something taut does",
    added="a tension at rest ({amount})",
)
