"""A base that another recording of the same body told, as what is known of it before this one is looked at."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from surgisim.artifacts.base import load
from surgisim.artifacts.physics import Physics
from surgisim.diagnosis.base import HIGH, LOW
from surgisim.diagnosis.clip import DENSITY
from surgisim.physics.catalogue import choose
from surgisim.problem import Problem
from surgisim.recordings.recording import Recording

UNITS = {"E": "Pa", "nu": "1", "eta": "Pa s"}
ALIKE = 0.1
"""By how much two densities may differ, over either, for a modulus told by one body's motion to hold for another's."""
Span = tuple[float, float]


@dataclass(frozen=True)
class Elsewhere:
    """What another recording told of a base."""

    spans: dict[str, Span]
    """90 % intervals of "E" [Pa], "nu" [1] and "eta / E" [s], as far as it told them."""
    density: float
    """With which it told them [kg/m^3]."""
    passed_over: tuple[str, ...] = ()
    """Laws beside the base that it had too."""
    file: str = ""
    """Its name, for a reader."""

    def told(self) -> dict[str, Any]:
        """As diagnosis.json has it."""
        units = {"E": "Pa", "nu": "1", "eta / E": "s"}
        numbers = {n: {"low": low, "high": high, "unit": units[n]} for n, (low, high) in self.spans.items()}
        return {"file": self.file, "numbers": numbers, "passed_over": list(self.passed_over)}


def read_elsewhere(path: Path) -> Elsewhere:
    """The base in a physics.json, with its intervals; as it was without what is named beside it, where that is told.

    Raises Problem where the file is none, or its numbers have no intervals, are in other units, or lie beyond what is
    tried of a base.
    """
    physics = load(Physics, path)
    laws = choose(physics.terms, str(path))
    elastic = next((n for n, t in laws.items() if t.energy is not None and {"E", "nu"} <= set(t.params)), None)
    if elastic is None:
        raise Problem(
            f"{path}: none of its laws {list(laws)} has a modulus E and a ratio nu, which a base has. Pass the "
            "physics.json of a diagnosis or of a run."
        )
    numbers = {name: physics.terms[elastic].get(name) for name in ("E", "nu")}
    numbers["eta"] = physics.terms.get("newtonian", {}).get("eta")
    if physics.alone:
        numbers = {name: physics.alone.get(name) for name in numbers}
    spans = {n: _span(entry, n, path) for n, entry in numbers.items() if entry is not None}
    spans = {n: span for n, span in spans.items() if span is not None}
    ratio = (physics.alone or physics.ratios).get("eta / E")
    spans["eta / E"] = _ratio(spans) if ratio is None else (float(ratio["low"]), float(ratio["high"]))
    spans = {n: span for n, span in spans.items() if n != "eta" and span is not None}
    if not spans:
        raise Problem(f"{path}: gives no 90 % interval, 'low' to 'high', of E, nu or eta. Diagnose its recording anew.")
    for k, name in enumerate(("E", "nu", "eta / E")):
        _within(path, name, spans.get(name), (LOW[k], HIGH[k]) if k == 1 else np.exp((LOW[k], HIGH[k])))
    others = tuple(n for n in laws if n not in (elastic, "newtonian"))
    return Elsewhere(spans, physics.density, others, path.name)


def known_from(recording: Recording, elsewhere: Elsewhere) -> Recording:
    """The recording with what another one told of its base, which goes before what it says of it itself.

    Raises Problem where the two have other densities: a modulus read off a body's motion goes with it.
    """
    mine = recording.density or DENSITY
    if abs(np.log(mine / elsewhere.density)) > ALIKE:
        raise Problem(
            f"recording {recording.name}: its density is {mine:g} kg/m^3, but that of the base in {elsewhere.file} is "
            f"{elsewhere.density:g}, and a modulus goes with it. Mend the one that is wrong, in kg/m^3."
        )
    return replace(recording, expected={**recording.expected, **elsewhere.spans})


def words(elsewhere: Elsewhere, as_given: Sequence[str]) -> str:
    """For a reader; as_given: numbers that this recording makes hardly surer."""
    said = f"Its base begins with what {elsewhere.file} tells of {_listed(list(elsewhere.spans))}."
    kept = [n for n in elsewhere.spans if n in as_given]
    if kept:
        said += f" This recording adds little to {_listed(kept)}."
    if elsewhere.passed_over:
        laws = _listed([n.replace("_", " ") for n in elsewhere.passed_over])
        said += f" What else is named there ({laws}) is no part of it."
    return said


def _span(entry: Mapping[str, Any], name: str, path: Path) -> Span | None:
    if entry.get("unit") != UNITS[name]:
        raise Problem(f"{path}: {name} is in {entry.get('unit')!r}, but {UNITS[name]!r} is wanted. Convert it.")
    low, high = entry.get("low"), entry.get("high")
    if low is None or high is None or entry.get("identifiable") is False:
        return None
    if not (np.isfinite([low, high]).all() and 0 < low <= high):
        raise Problem(f"{path}: {name} is said to lie from {low!r} to {high!r}; two rising numbers above 0 are wanted.")
    return float(low), float(high)


def _ratio(spans: Mapping[str, Span]) -> Span | None:
    """Of eta and E, taken to be known apart."""
    if not {"E", "eta"} <= set(spans):
        return None
    (stiff, wide), (slow, long) = (
        (np.log(low * high) / 2, np.log(high / low) / 2) for low, high in (spans["E"], spans["eta"])
    )
    reach = np.hypot(wide, long)
    return float(np.exp(slow - stiff - reach)), float(np.exp(slow - stiff + reach))


def _within(path: Path, name: str, span: Span | None, tried: Span) -> None:
    if span is not None and not (span[0] <= tried[1] and span[1] >= tried[0]):
        raise Problem(
            f"{path}: {name} lies from {span[0]:.3g} to {span[1]:.3g}, but {tried[0]:.3g} to {tried[1]:.3g} "
            f"{'Pa' if name == 'E' else 's' if name == 'eta / E' else ''} is what a base is tried with".rstrip()
            + ". Is it in another unit?"
        )


def _listed(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
