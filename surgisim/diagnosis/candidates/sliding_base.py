"""A base that holds by friction, all of it or a patch: where it slides depends on where it slid.

So the engine runs a few caps. Patches are tried where the base bears the largest traction: elsewhere none would slide.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from surgisim.diagnosis import knobs
from surgisim.diagnosis.candidate import Candidate, Parts
from surgisim.diagnosis.form import Block, angles, scale
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.law import Law, placed
from surgisim.diagnosis.laws import respond
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.scopes import EVERYWHERE, Where
from surgisim.diagnosis.uncertain import scaled
from surgisim.estimation.trial import at_once
from surgisim.mpm.simulator import Breakdown
from surgisim.physics.place import Place

NAME = "sliding_base"
CAPS = (0.015, 0.03, 0.05, 0.09, 0.16, 0.35)
"""Friction that a base is tried with, over the largest traction it bears: that is found in few places, below a grip."""

CAPS_HERE = (0.03, 0.09, 0.25)
"""The same of a patch."""
PATCHES = 3
"""At most."""
PATCH = 0.006
"""Extent of a patch [m], for a body of 36 mm; it follows the body's size."""
LOADED = 0.5
"""Share of the largest traction that a patch must bear."""


def law(h, amplitude, clip) -> Law:
    yaw, pitch = angles(clip.normal)
    own = {"share": 1.0, "stiffness": h.about["stiffness"], "yaw": yaw, "pitch": pitch}
    return Law({NAME: {**own, "cap": h.about["cap"] / max(float(amplitude[0]), 1e-3)}}, placed(h, NAME))


def costly(look: Look) -> Parts:
    if look.clip.body.held.any() and len(look.clip.motion.radius):
        yield "a gliding base", lambda: _gliding(look)


def _gliding(look: Look) -> Iterator[Block]:
    clip, base = look.clip, look.base
    held, volume = clip.body.held, base.prepared.simulator.volume_p
    spring = clip.density * float(np.trace(base.drive.stiffness[0])) / 3
    dragged, whole = _dragged(look), float(volume[held].sum())
    tried = [
        Hypothesis(NAME, np.ones((1, 1)), 1, where.place, about=about, scope=where.scope)
        for where in (EVERYWHERE, *_patches(look, dragged))
        for share in (CAPS if where.place is None else CAPS_HERE)
        for about in [{"cap": share * float(dragged.max()) * spring * whole, "stiffness": spring * whole}]
    ]

    def moved(h: Hypothesis, _worker: int) -> np.ndarray | None:
        try:
            return respond(clip, base, law(h, np.ones(1), clip), look.memo, clip.until)
        except Breakdown:
            return None

    answers = list(zip(tried, at_once(moved, tried, look.workers), strict=True))
    found = [h for h, answer in answers if answer is not None]
    columns = [answer - base.simulated[:, : clip.until] for _, answer in answers if answer is not None]
    if columns:
        eye = np.eye(len(columns))
        yield Block(np.stack(columns), [replace(h, mix=eye[:, k : k + 1]) for k, h in enumerate(found)])


def _dragged(look: Look) -> np.ndarray:
    """How far every particle that is held is drawn along the base at most [m], (P,); zero for what is free."""
    near, normal = look.base.tangent, look.clip.normal
    across = np.eye(3) - np.outer(normal, normal)
    most = np.max([np.linalg.norm(near.displacement(f) @ across, axis=1) for f in near.frames], axis=0)
    return most * look.clip.body.held


def _patches(look: Look, dragged: np.ndarray) -> list[Where]:
    """The most loaded one first, then what is loaded and lies outside those before."""
    left, found, extent = dragged.copy(), [], PATCH * scale(look.clip)
    while len(found) < PATCHES and left.max() > LOADED * dragged.max() > 0:
        center = look.rest[int(left.argmax())].astype(float)
        found.append(Where("patch", Place(tuple(center), extent)))
        left[np.linalg.norm(look.rest - center, axis=1) < 2 * extent] = 0.0
    return found


def beside(h: Hypothesis, amplitude: np.ndarray, stiffer: float) -> tuple[Hypothesis, np.ndarray]:
    return replace(h, about={k: stiffer * v for k, v in h.about.items()}), amplitude


CANDIDATE = Candidate(
    law=law,
    costly=costly,
    knobs=lambda h, a: [*knobs.strength(h, a), *knobs.place(h)],
    interval=scaled("cap", over_stiffness=True),
    beside=beside,
    seen="the tissue glides along its base {where} where it is pulled hard",
    added="a base with friction ({amount})",
)
