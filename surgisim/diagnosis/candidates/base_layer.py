"""Deep tissue, all that lies below a plane, is stiffer or softer than what lies above it."""

from collections.abc import Iterator

from surgisim.diagnosis import knobs
from surgisim.diagnosis.candidate import Candidate, Parts
from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.inclusion import interval, law, stiffer
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.scopes import Where, around, beyond

NAME = "base_layer"
SHARES = (0.25, 0.35, 0.45, 0.55)
"""Of the thickness above what is held, up to which a layer is tried."""


def tried(look: Look) -> Parts:
    if look.clip.body.held.any():
        wheres = [Where("layer", beyond(look, share, -look.clip.normal)) for share in SHARES]
        yield "layers", lambda: iter([stiffer(look, NAME, wheres)])


def finer(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    yield stiffer(look, NAME, around(look, h, step))


CANDIDATE = Candidate(
    law=law,
    tried=tried,
    finer=finer,
    knobs=lambda h, a: [*knobs.amplitudes(h, a), *knobs.place(h)],
    interval=interval,
    seen="the deep tissue strains {less} than what lies above it",
    added="a layer of another stiffness ({amount})",
)
