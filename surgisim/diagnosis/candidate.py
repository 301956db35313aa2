"""A law as the diagnosis may name it: how it is tried, run, fitted freely, and said."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.knobs import Knob
from surgisim.diagnosis.law import Law
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.uncertain import Interval
from surgisim.physics.catalogue import choose

Parts = Iterator[tuple[str, Callable[[], Iterator[Block]]]]
"""Names of parts, and what makes their blocks."""
Numbers = dict[str, tuple[float, str]]
"""Parameter -> value and unit."""


def untried(look: Look) -> Parts:
    yield from ()


def coarse(look: Look, h: Hypothesis, step: float) -> Iterator[Block]:
    """Of a law whose coarse search is fine enough."""
    yield from ()


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One file of `candidates/` holds one; its name is the law's in verdicts."""

    law: Callable[[Hypothesis, np.ndarray, Clip], Law]
    """What the engine runs for a hypothesis with amplitudes (H,)."""
    knobs: Callable[[Hypothesis, np.ndarray], list[Knob]]
    """What a fit with everything free may turn."""
    interval: Interval
    """Parameters with the ends that the amplitude's spread alone gives them, (low, high)."""
    seen: str
    """What tissue does, with {where}, {onset}, {end} and {less} to be filled in."""
    added: str
    """What is added to the simulation, with {amount}."""
    tried: Callable[[Look], Parts] = untried
    """Parts whose signatures are cheap. Parts of one name, of several laws, are made one after the other."""
    costly: Callable[[Look], Parts] = untried
    """What only runs of the engine can tell; tried where something is to be told."""
    finer: Callable[[Look, Hypothesis, float], Iterator[Block]] = coarse
    """Blocks around a hypothesis; the last argument is a share of the coarse search's spacing."""
    beside: Callable[[Hypothesis, np.ndarray, float], tuple[Hypothesis, np.ndarray]] | None = None
    """What does the same in tissue some times as stiff; None where strength shows by itself."""
    light: Callable[[Hypothesis, np.ndarray, Clip], Law] | None = None
    """The same without its inertia; None where it has none that counts."""
    numbers: Callable[[Hypothesis, np.ndarray], Numbers] | None = None
    """Parameters of a law that acts on the grips' motion and so has none of a term."""
    modelled: Callable[[Hypothesis, np.ndarray], dict[str, dict[str, float]]] | None = None
    """Term -> parameters of such a law, as physics.json has it."""
    unsaid: tuple[str, ...] = ()
    """Terms it needs whose numbers follow from its own."""
    presses: bool = False
    """Whether it can only be what presses on a surface (contact.py)."""
    free_course: bool = False
    """Whether place, direction and course are so free that it follows whatever comes and goes."""
    exact_extent: bool = False
    """Whether its place ends where its extent says, as a grip's does, and does not fade."""

    def parameters(self, h: Hypothesis, amplitude: np.ndarray, clip: Clip) -> Numbers:
        """What the law's parameters are, with their units."""
        if self.numbers is not None:
            return self.numbers(h, amplitude)
        found: Numbers = {}
        for name, numbers in self.law(h, amplitude, clip).values.items():
            if name not in self.unsaid:
                params = choose([name])[name].params
                found |= {key: (float(value), params[key].unit) for key, value in numbers.items()}
        return found


def stronger(h: Hypothesis, amplitude: np.ndarray, stiffer: float) -> tuple[Hypothesis, np.ndarray]:
    """Of what pushes or resists beside the tissue's own stiffness."""
    return h, stiffer * amplitude
