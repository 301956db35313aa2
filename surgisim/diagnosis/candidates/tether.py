"""A band to what lies below holds tissue back once it has moved so far that the band is taut."""

from collections.abc import Iterator

import numpy as np

from surgisim.diagnosis import knobs, pushes
from surgisim.diagnosis.candidate import Candidate, Parts, stronger
from surgisim.diagnosis.form import Block, angles, scale
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.law import Law
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.uncertain import scaled
from surgisim.physics.catalogue import choose
from surgisim.physics.place import Place

NAME = "tether"
SLACKS = (0.0, 3e-4, 6e-4, 1.0e-3, 2e-3)
LENGTHS = (1.5e-3, 4e-3)
"""Of a band that is tried [m], for a body of 36 mm; they follow the body's size."""
SLACK = 5e-4
"""How far a slack may be off [m]."""


def law(h, amplitude, clip) -> Law:
    yaw, pitch = angles(h.about["down"])
    own = {"slack": h.about["slack"], "length": h.about["length"], "yaw": yaw, "pitch": pitch}
    return Law({NAME: {"stiffness": float(amplitude[0]), **own}}, {NAME: h.place})


def _block(look: Look, place: Place) -> Block:
    clip, near, term = look.clip, look.base.tangent, choose([NAME])[NAME]
    frames = np.clip(np.round(pushes.times(clip) * clip.fps).astype(int), 0, clip.until - 1)
    weight = pushes.weight(look, place)
    mine = weight > 1e-3 * weight.max()
    share = weight[mine] * look.base.prepared.simulator.volume_p[mine]
    moved = np.stack([near.displacement(f)[mine] for f in frames])
    down, found = -clip.normal, []
    for slack in SLACKS:
        for length in LENGTHS:
            own = {"slack": slack * scale(clip), "length": length * scale(clip)}
            force = term.twin(
                moved, None, None, np.ones(mine.sum()), 0.0, stiffness=1.0, x=down[0], y=down[1], z=down[2], **own
            )
            total = np.einsum("tpd,p->td", force, share)
            if np.abs(total).max() > 1e-5:
                about = {**own, "down": down}
                found.append(Hypothesis(NAME, total.T.reshape(-1, 1), 1, place, about=about, scope="blob"))
    return Block(pushes.columns(look, place), found)


def tried(look: Look) -> Parts:
    for part, place in pushes.places(look):
        yield part, lambda p=place: iter([_block(look, p)])


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    for place in pushes.around(look, h, step):
        yield _block(look, place)


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    finer=finer,
    knobs=lambda h, a: [*knobs.strength(h, a), *knobs.place(h), knobs.plus("slack", SLACK, low=0.0)],
    interval=scaled("stiffness", over_stiffness=True),
    beside=stronger,
    seen="the tissue {where} is held back once it has moved, as by an adhesion",
    added="a band there ({amount})",
)
