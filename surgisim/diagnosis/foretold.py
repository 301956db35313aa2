"""How far a prediction may be off in frames held out: its numbers are known only as well as the fitted ones tell them.

Of the base those are E, nu and eta, with the covariance of its fit (`Known`); of a law its strength, with chi square
divided as where intervals are read off it (calibration.ALIKE_ERRORS). What they do there is a secant of engine runs one
standard deviation away.
"""

import numpy as np

from surgisim.diagnosis import calibration
from surgisim.diagnosis.base import Known, bounded, tracks_of
from surgisim.diagnosis.laws import IMPOSSIBLE
from surgisim.diagnosis.prospect import Foretold
from surgisim.estimation.trial import at_once

LEAST = 0.3
"""Share of a standard deviation that must lie within what is tried, for a secant [1]."""
FINEST = 0.01
"""Of a prior standard deviation: least step of a secant, so that it is no difference of rounding [1]."""


def of_base(case) -> Foretold:
    """The base alone, of a `Case`."""
    return Foretold(case.base.simulated, case.by_base.ways(case.base.known))


def of_laws(case, refits: list, moved: np.ndarray, known: Known | None = None) -> Foretold:
    """Laws of a `Joint`; moved: displacement with all of them [m], (K, T, 3); known: how surely the numbers of the base
    beside them, as its fit with the first of them has it if None."""
    known, until = known or refits[0].known or case.base.known, case.clip.until
    own = []
    for law in refits:
        white = case.whiten(law.response[:, :until])[:, None]
        heat = calibration.temperature(calibration.ALIKE_ERRORS, law.gain)
        own.append(law.response / np.sqrt(1 + float(case.space.gram(white, white)[0, 0]) / heat))
        own[-1][:, :until] = 0.0
    return Foretold(moved, np.concatenate([case.by_base.ways(known), own]))


class ByBase:
    """What the base's numbers do in frames held out."""

    def __init__(self, case) -> None:
        clip, self.unit = case.clip, case.clip.prior.spread
        spread, vectors = np.linalg.eigh(self._scaled(case.base.known))
        self.axes = vectors * np.sqrt(np.maximum(spread, FINEST**2))
        """Columns, one standard deviation each, in units of the prior's, (3, 3)."""
        self.fields = np.stack(at_once(lambda axis, _: self._secant(case, axis), list(self.axes.T), case.workers))
        """What each does [m], (3, K, T, 3)."""
        self.fields[:, :, : clip.until] = 0.0

    def ways(self, known: Known) -> np.ndarray:
        """Of numbers that are known so well, independent ones at one standard deviation [m], (3, K, T, 3)."""
        factor = np.linalg.cholesky(self._scaled(known) + 1e-12 * np.eye(3))
        return np.tensordot(np.linalg.solve(self.axes, factor).T, self.fields, 1)

    def _scaled(self, known: Known) -> np.ndarray:
        """Covariance in units of the prior's spread, (3, 3)."""
        return (known.near + known.aside.T @ known.aside / len(known.aside)) / np.outer(self.unit, self.unit)

    def _secant(self, case, axis: np.ndarray) -> np.ndarray:
        """Of the points [m], (K, T, 3); nothing where neither side is tried, or bears it."""
        x = case.base.x[:3]
        for way in (axis, -axis):
            there = bounded(x + way * self.unit, case.clip)
            share = float(((there - x) / self.unit) @ way / (way @ way))
            if share < LEAST:
                continue
            try:
                return (tracks_of(case.clip, there, case.memo) - case.base.simulated) / share
            except IMPOSSIBLE:
                continue
        return np.zeros_like(case.base.simulated)
