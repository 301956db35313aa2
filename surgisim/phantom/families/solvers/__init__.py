"""What computes a family: one module each, with the names that it can hide, and `paths`."""

import importlib
from typing import Protocol

import numpy as np

from surgisim.phantom.families.hidden import Hidden
from surgisim.phantom.families.world import World


class Solver(Protocol):
    CONCEALS: tuple[str, ...]
    OWN: tuple[str, ...]
    """Those whose magnitude means something in this solver alone, so that nobody's number can be held against it."""
    MOST_E: float
    """Stiffest tissue that it moves in bearable time [Pa]."""

    def paths(self, world: World, hidden: tuple[Hidden, ...]) -> np.ndarray:
        """True paths of the probes [m], (K, T, 3). Raises Problem where the body does not bear it."""


def solver(name: str) -> Solver:
    return importlib.import_module(f"{__name__}.{name}")
