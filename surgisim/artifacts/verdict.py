"""A diagnosis as it is read by whoever scores or shows it, whoever wrote it: format surgisim-diagnosis/1.

More fields than these are welcome in the file; they are passed over.
"""

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from surgisim.artifacts.character import Character
from surgisim.artifacts.goodness import Goodness, Nuisance, goodness, nuisances, untold
from surgisim.problem import Problem

FORMAT = "surgisim-diagnosis/1"
NAMED = ("named", "equivalence class")
VERDICTS = (*NAMED, "nothing detectable", "unexplained")


@dataclass(frozen=True)
class Effect:
    """One law that a verdict names."""

    term: str
    probability: float
    center: tuple[float, float, float] | None = None
    """Where [m]; None where it acts everywhere."""
    extent: float | None = None
    """Radius about the centre [m]."""
    onset: float | None = None
    """[s]; None where it acts from the beginning."""
    end: float | None = None
    """[s]"""
    parameters: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Name -> {"value", "low", "high", "unit"}."""
    runners_up: tuple[tuple[str, float], ...] = ()
    """Other laws, each with its probability."""
    separating_experiment: str = ""


@dataclass(frozen=True)
class Candidate:
    """One law at one place, as it came out of the comparison."""

    term: str
    center: tuple[float, float, float] | None
    log_evidence: float | None
    probability: float
    cos: float | None
    """Likeness of its signature to the named law's [1]."""
    held_out_rms: float | None
    """Error on the frames held out once it is fitted [mm]."""


LARGEST, PULLED = "A", "B"
"""Markers of where the misfit is largest and of where a pull takes hold that would separate two laws."""


@dataclass(frozen=True)
class Marker:
    """A place that the words, the pictures and the tables call by one number or letter."""

    mark: str
    of: str
    """A law's name, or what else is there."""
    center: tuple[float, float, float]
    """In the recording's frame [m]."""
    extent: float | None = None
    """Radius about the centre [m]."""
    time: float | None = None
    """[s]"""


@dataclass(frozen=True)
class Residual:
    """A law without a name, where a verdict is that no law explains what is there."""

    laws: tuple[Effect, ...]
    """Its parts, their probability 1; none where none pays for its numbers."""
    character: dict[str, Any]
    """Fields of artifacts/character.py's Character; empty without laws."""
    held_out: dict[str, float]
    """noise_floor, before, after, flexible [mm], as far as known."""
    helps: bool
    """Whether the frames held out come nearer, so that physics.json has it."""
    numbers: int
    """How many were free."""
    words: str


@dataclass(frozen=True)
class Verdict:
    recording: str
    verdict: str
    """One of VERDICTS."""
    effects: tuple[Effect, ...]
    ranking: tuple[Candidate, ...]
    """Most probable first; may be empty."""
    detectable_above: float | None
    """[mm]"""
    missing_phases: tuple[str, ...]
    fit: dict[str, float]
    """noise_floor, before, after, placebo, flexible [mm], as far as known."""
    held_out: dict[str, float]
    unexplained: float | None
    """Share of the whitened misfit that nothing named explains [1]."""
    words: str
    markers: tuple[Marker, ...] = ()
    nuisances: tuple[Nuisance, ...] = ()
    goodness: Goodness | None = None
    untold: tuple[str, ...] = ()
    """Parameters that the recording does not tell."""
    evidence: float | None = None
    """Log evidence of the best law over nothing [1]."""
    residual: Residual | None = None
    """What was modelled without a name; None where nothing was."""

    @property
    def names(self) -> tuple[str, ...]:
        """The laws it names, most probable first; none where it abstains."""
        return tuple(e.term for e in self.effects) if self.verdict in NAMED else ()


def read_verdict(path: Path) -> Verdict:
    """The diagnosis at `path`. Raises Problem, naming the field, for what a reader could misread."""
    body = _json(path)
    if body.get("format") != FORMAT:
        raise Problem(f"{path}: its format is {body.get('format')!r}, and {FORMAT!r} is read here. Diagnose anew.")
    missing = [key for key in ("recording", "verdict", "effects") if key not in body]
    if missing:
        raise Problem(f"{path}: lacks {missing}. Diagnose anew.")
    if body["verdict"] not in VERDICTS:
        raise Problem(f"{path}: 'verdict' is {body['verdict']!r}, and {list(VERDICTS)} are known. Diagnose anew.")
    effects = tuple(_effect(raw, f"{path}: effect {i}") for i, raw in enumerate(body["effects"] or ()))
    if body["verdict"] in NAMED and not effects:
        raise Problem(f"{path}: the verdict is '{body['verdict']}', but no effect is given. Diagnose anew.")
    above = body.get("detectable_above")
    return Verdict(
        str(body["recording"]),
        body["verdict"],
        effects,
        tuple(_candidate(raw, f"{path}: candidate {i}") for i, raw in enumerate(body.get("ranking") or ())),
        millimetres(above["value"], above.get("unit", "mm"), f"{path}: detectable_above") if above else None,
        tuple(body.get("missing_phases") or ()),
        _errors(body.get("fit"), f"{path}: fit"),
        _errors(body.get("held_out"), f"{path}: held_out"),
        body.get("unexplained_fraction"),
        str(body.get("words", "")),
        _markers(body.get("markers"), effects, path),
        nuisances(body, str(path)),
        goodness(body, str(path)),
        untold(body),
        _evidence(body.get("global_test")),
        _residual(body.get("residual"), f"{path}: residual"),
    )


def _evidence(test: Any) -> float | None:
    found = test.get("log_evidence") if isinstance(test, dict) else None
    return float(found) if isinstance(found, int | float) else None


def millimetres(value: float, unit: str, where: str) -> float:
    """A length in m or mm as millimetres."""
    if unit not in ("m", "mm"):
        raise Problem(f"{where}: its unit is {unit!r}, and 'm' or 'mm' is wanted. Diagnose anew.")
    return float(value) * (1e3 if unit == "m" else 1.0)


def _effect(raw: Any, where: str) -> Effect:
    if not isinstance(raw, dict) or not isinstance(raw.get("term"), str):
        raise Problem(f"{where}: a law's name under 'term' is wanted. Diagnose anew.")
    center, extent = _place(raw.get("place"), where)
    time = raw.get("time") or {}
    others = tuple((r["term"], _probability(r, where)) for r in raw.get("runners_up") or ())
    return Effect(
        raw["term"],
        _probability(raw, where),
        center,
        extent,
        time.get("onset"),
        time.get("end"),
        raw.get("parameters") or {},
        others,
        str(raw.get("separating_experiment") or ""),
    )


def _residual(raw: Any, where: str) -> Residual | None:
    if not raw:
        return None
    laws = tuple(
        _effect({**law, "probability": 1.0}, f"{where}, law {i}") for i, law in enumerate(raw.get("laws") or ())
    )
    character = raw.get("character") or {}
    if laws and set(character) != set(Character.__dataclass_fields__):
        raise Problem(f"{where}: its character has {sorted(character)}, but other fields are wanted. Diagnose anew.")
    errors = _errors(raw.get("held_out"), f"{where}: held_out")
    return Residual(laws, character, errors, bool(raw.get("helps")), int(raw.get("numbers") or 0), str(raw["words"]))


def _markers(raw: Any, effects: tuple[Effect, ...], path: Path) -> tuple[Marker, ...]:
    """As given; effects are numbered where none are, as in files that were written before."""
    if raw is None:
        numbered = enumerate(effects, 1)
        return tuple(Marker(str(n), e.term, e.center, e.extent, e.onset) for n, e in numbered if e.center)
    result = []
    for i, each in enumerate(raw):
        where = f"{path}: marker {i}"
        if not isinstance(each, dict) or not {"mark", "of", "center"} <= each.keys():
            raise Problem(f"{where}: 'mark', 'of' and 'center' are wanted. Diagnose anew.")
        center, extent = _place(each, where)
        if center is None:
            raise Problem(f"{where}: its centre is missing. Diagnose anew.")
        result.append(Marker(str(each["mark"]), str(each["of"]), center, extent, each.get("time")))
    return tuple(result)


def _candidate(raw: Any, where: str) -> Candidate:
    if not isinstance(raw, dict) or not isinstance(raw.get("term"), str):
        raise Problem(f"{where}: a law's name under 'term' is wanted. Diagnose anew.")
    numbers = (raw.get(key) for key in ("log_evidence", "cos", "held_out_rms"))
    evidence, cos, rms = (None if x is None else float(x) for x in numbers)
    return Candidate(raw["term"], _place(raw.get("place"), where)[0], evidence, _probability(raw, where), cos, rms)


def _place(raw: Any, where: str) -> tuple[tuple[float, float, float] | None, float | None]:
    """Centre and extent [m]; None for 'everywhere'."""
    if not isinstance(raw, dict):
        return None, None
    center = raw.get("center")
    if center is None:
        return None, None
    if len(center) != 3 or not all(math.isfinite(x) for x in center):
        raise Problem(f"{where}: the centre of its place is {center!r}, but three numbers are wanted. Diagnose anew.")
    scale = 1e-3 * millimetres(1.0, raw.get("unit", "m"), f"{where}, place")
    x, y, z = (scale * float(c) for c in center)
    extent = raw.get("extent")
    return (x, y, z), None if extent is None else scale * float(extent)


def _probability(raw: dict[str, Any], where: str) -> float:
    value = raw.get("probability")
    if not isinstance(value, int | float) or not -1e-9 <= value <= 1 + 1e-9:
        raise Problem(f"{where}: its probability is {value!r}, but a number from 0 to 1 is wanted. Diagnose anew.")
    return float(value)


def _errors(raw: Any, where: str) -> dict[str, float]:
    if not raw:
        return {}
    unit = raw.get("unit", "mm")
    known = ("noise_floor", "before", "after", "placebo", "flexible", "oracle")
    return {key: millimetres(raw[key], unit, where) for key in known if raw.get(key) is not None}


def _json(path: Path) -> dict[str, Any]:
    if not path.is_file():
        raise Problem(f"{path}: no such file, but a diagnosis is wanted here. Run the diagnosis first.")
    try:
        body = json.loads(path.read_text("utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise Problem(f"{path}: is not JSON ({error}). Diagnose anew.") from error
    if not isinstance(body, dict):
        raise Problem(f"{path}: holds a {type(body).__name__}, but a diagnosis is wanted here. Diagnose anew.")
    return body
