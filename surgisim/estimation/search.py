"""The few numbers a fit searches, and their way into a simulation."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.motion import Motion
from surgisim.estimation.carrying import Carrying
from surgisim.estimation.unknown import DIFFERENCE, Unknown
from surgisim.mpm.setup import Values
from surgisim.physics.catalogue import Param, choose
from surgisim.problem import Problem

NARROW = 0.3
"""Longest step of a difference, as a share of a number's prior deviation."""
PRIOR_LOG = 1.5
"""Standard deviation of the prior on a logarithm: tissue moduli spread over a factor 4-5 either way."""
REACH = 2.0
"""How many prior deviations from its start a logarithm may go."""
PACE = {"Pa": 1.0, "Pa s": 0.5, "s": -0.5}
"""Power of a modulus with which a number of this unit goes where only the pace of a swing changes."""
PRIOR_SHARE = 0.3
"""The same for a plain parameter, as a share of its range."""


@dataclass(frozen=True)
class Search:
    """A point x in search space: the laws' numbers (logarithms of moduli, plain ratios), then what else is open."""

    terms: tuple[str, ...]
    free: tuple[tuple[str, str, Param], ...]
    """Law, parameter and its description, in the order of x."""
    base: Values
    """Every parameter's start value."""
    carrying: Carrying | None = None
    """What is open of the grips, fitted too."""
    depth: Unknown | None = None
    """How deep the tissue is held, fitted too."""

    @property
    def names(self) -> list[str]:
        return [f"{law}.{param}" for law, param, _ in self.free] + [u.name for u in self.open]

    @property
    def open(self) -> tuple[Unknown, ...]:
        """Numbers beside the laws'."""
        return (*(self.carrying.unknowns if self.carrying else ()), *([self.depth] if self.depth else []))

    @property
    def start(self) -> np.ndarray:
        laws = [_forward(p, self.base[law][name]) for law, name, p in self.free]
        return np.array(laws + [u.start for u in self.open])

    @property
    def spread(self) -> np.ndarray:
        """Prior standard deviation of each component of x."""
        laws = [PRIOR_LOG if p.logarithmic else PRIOR_SHARE * (p.high - p.low) for *_, p in self.free]
        return np.array(laws + [u.spread for u in self.open])

    @property
    def differences(self) -> np.ndarray:
        """Steps by which derivatives are taken, (M,)."""
        steps = np.array([DIFFERENCE] * len(self.free) + [u.difference for u in self.open])
        return np.minimum(steps, NARROW * self.spread)

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest x: each law's own range, and for logarithms at most REACH prior deviations from the start.

        Where a clip cannot tell a modulus, the descent would wander to the end of its range, and a hundred times
        stiffer tissue costs ten times the steps.
        """
        ends = [(_forward(p, p.low), _forward(p, p.high)) for *_, p in self.free]
        low, high = np.array(ends + [(u.low, u.high) for u in self.open]).reshape(-1, 2).T
        logarithmic = np.array([p.logarithmic for *_, p in self.free] + [False] * len(self.open), bool)
        reach = np.where(logarithmic, REACH * self.spread, np.inf)
        return np.maximum(low, self.start - reach), np.minimum(high, self.start + reach)

    @property
    def paces(self) -> np.ndarray:
        """Which numbers set the pace of a swing or how it dies off, (M,) bool."""
        laws = [p.logarithmic and p.unit in PACE for *_, p in self.free]
        return np.array(laws + [False] * len(self.open), bool)

    @property
    def opens(self) -> np.ndarray:
        """Which numbers say when jaws open, (M,) bool."""
        return np.array([name.endswith(".release") for name in self.names], bool)

    def paced(self, x: np.ndarray, modulus: float, damping: float = 0.0) -> np.ndarray:
        """x with moduli that many logarithms higher, at the same swing at another pace; then viscosities so much."""
        moved = x.copy()
        for k in np.flatnonzero(self.paces):
            unit = self.free[k][-1].unit
            moved[k] += PACE[unit] * modulus + (damping if unit == "Pa s" else 0.0)
        return moved

    def log_modulus_ratio(self, x: np.ndarray, other: np.ndarray) -> float:
        """The largest logarithm, either way, of the ratio of two points' moduli."""
        moduli = [k for k in np.flatnonzero(self.paces) if PACE[self.free[k][-1].unit] == 1]
        return float(np.abs(x - other)[moduli].max(initial=0.0))

    def values(self, x: np.ndarray) -> Values:
        """Law -> parameter -> value at x."""
        result = {law: dict(params) for law, params in self.base.items()}
        for (law, name, p), value in zip(self.free, x[: len(self.free)], strict=True):
            result[law][name] = float(np.exp(value) if p.logarithmic else value)
        return result

    def motion(self, x: np.ndarray, found: Motion) -> Motion:
        """How the instruments carry the tissue at x: as `found` where nothing is open."""
        return self.carrying.at(self._opened(x)) if self.carrying else found

    def held_from(self, x: np.ndarray) -> float:
        """How deep the tissue is held at x [m]."""
        return self.depth.size * float(np.exp(self._opened(x)[self.depth.name]))

    def _opened(self, x: np.ndarray) -> dict[str, float]:
        return dict(zip((u.name for u in self.open), x[len(self.free) :].tolist(), strict=True))


def search(
    terms: list[str],
    start: Values,
    fixed: list[str],
    carrying: Carrying | None = None,
    depth: Unknown | None = None,
) -> Search:
    """Everything the laws have, less what is fixed; refuses names that do not exist and values out of range."""
    chosen = choose(terms)
    known = {f"{law}.{p}" for law, t in chosen.items() for p in t.params}
    for name in [*fixed, *(f"{law}.{p}" for law, ps in start.items() for p in ps)]:
        if name not in known:
            raise Problem(f"estimation: '{name}' is no parameter of the chosen laws, which have {sorted(known)}.")
    base, free = {}, []
    for law, term in chosen.items():
        base[law] = {}
        for name, p in term.params.items():
            value = start.get(law, {}).get(name, p.default)
            if not (p.low <= value <= p.high or value == p.off):
                raise Problem(
                    f"estimation: start value {value} of '{law}.{name}' is outside {p.low:g} to {p.high:g} {p.unit}. "
                    "Choose one inside."
                )
            base[law][name] = float(value)
            # A logarithm cannot leave an off value of zero: a law that starts silent stays so.
            if f"{law}.{name}" not in fixed and not (p.logarithmic and value <= 0):
                free.append((law, name, p))
    return Search(tuple(terms), tuple(free), base, carrying, depth)


def _forward(p: Param, value: float) -> float:
    return float(np.log(value) if p.logarithmic else value)
