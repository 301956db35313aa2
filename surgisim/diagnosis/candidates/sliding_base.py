"""A base that holds by friction: where it slides depends on where it slid, so the engine runs a few caps."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from surgisim.diagnosis import knobs
from surgisim.diagnosis.candidate import Candidate, Parts
from surgisim.diagnosis.form import Block, angles
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.law import Law
from surgisim.diagnosis.laws import respond
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.uncertain import scaled
from surgisim.estimation.trial import at_once
from surgisim.mpm.simulator import Breakdown

NAME = "sliding_base"
CAPS = (0.015, 0.03, 0.05, 0.09, 0.16, 0.35)
"""Friction that a base is tried with, over the largest traction it bears: that is found in few places, below a grip."""


def law(h, amplitude, clip) -> Law:
    yaw, pitch = angles(clip.normal)
    own = {"share": 1.0, "stiffness": h.about["stiffness"], "yaw": yaw, "pitch": pitch}
    return Law({NAME: {**own, "cap": h.about["cap"] / max(float(amplitude[0]), 1e-3)}}, {})


def costly(look: Look) -> Parts:
    if look.clip.body.held.any() and len(look.clip.motion.radius):
        yield "a gliding base", lambda: _gliding(look)


def _gliding(look: Look) -> Iterator[Block]:
    clip, base = look.clip, look.base
    near, held, volume = base.tangent, clip.body.held, base.prepared.simulator.volume_p
    spring = clip.density * float(np.trace(base.drive.stiffness[0])) / 3
    across = np.eye(3) - np.outer(clip.normal, clip.normal)
    pull = max(float(np.linalg.norm(near.displacement(f)[held] @ across, axis=1).max()) for f in near.frames) * spring
    whole = float(volume[held].sum())
    caps = [{"cap": share * pull * whole, "stiffness": spring * whole} for share in CAPS]
    tried = [Hypothesis(NAME, np.ones((1, 1)), 1, None, about=about) for about in caps]

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


def beside(h: Hypothesis, amplitude: np.ndarray, stiffer: float) -> tuple[Hypothesis, np.ndarray]:
    return replace(h, about={k: stiffer * v for k, v in h.about.items()}), amplitude


CANDIDATE = Candidate(
    law=law,
    costly=costly,
    knobs=lambda h, a: knobs.strength(h, a),
    interval=scaled("cap", over_stiffness=True),
    beside=beside,
    seen="the tissue glides along its base where it is pulled hard",
    added="a base with friction ({amount})",
)
