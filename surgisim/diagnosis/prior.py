"""What a base's numbers are taken to be before a recording is looked at, or as whoever recorded it knows them."""

from dataclasses import dataclass

import numpy as np

from surgisim.estimation.identify import NINETY
from surgisim.recordings.recording import Recording

START = np.array([np.log(5e3), 0.45, np.log(2e-3)])
"""log E [Pa], nu, log eta / E [s]: soft tissue and silicone gels lie between 1 and 50 kPa and .3 and 20 ms."""
SPREAD = np.array([1.2, 0.03, 1.4])
PLACES = {"E": 0, "nu": 1, "eta / E": 2}
"""Where numbers that may be known beforehand stand; all but nu are logarithms."""
SUREST, SUREST_RATIO = 0.15, 0.01
"""Least spread of a number that is known beforehand, a logarithm or nu, for another grid and a body of another form;
chosen. Of nu a coarse grid has one of its own, so that only a diagnosis' base is a prior for another's."""


@dataclass(frozen=True)
class Prior:
    """Of log E, nu and log eta / E."""

    middle: np.ndarray
    """(3,)"""
    spread: np.ndarray
    """Standard deviation, (3,)."""


USUAL = Prior(START, SPREAD)
"""Of tissue of which nothing is known."""


def prior_of(recording: Recording, surest: float = SUREST) -> Prior:
    """Usual tissue's, narrowed to what the recording says is known of its base; never wider than that.

    surest: least spread of a logarithm.

    Of a video an estimation knows it by the same tracks, which count twice then: intervals of the base may be too
    narrow by that, and their coverage has not been measured.
    """
    middle, spread = USUAL.middle.copy(), USUAL.spread.copy()
    for name, (low, high) in recording.expected.items():
        k, least = PLACES[name], SUREST_RATIO if name == "nu" else surest
        low, high = (low, high) if name == "nu" else (np.log(low), np.log(high))
        middle[k] = 0.5 * (low + high)
        spread[k] = np.clip((high - low) / (2 * NINETY), least, SPREAD[k])
    return Prior(middle, spread)
