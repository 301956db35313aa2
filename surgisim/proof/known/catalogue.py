"""What a real recording with a known cause is, and which there are.

Each is one module here that holds one `KNOWN`; nothing is registered elsewhere.
"""

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from surgisim.artifacts.verdict import Verdict
from surgisim.problem import Problem
from surgisim.proof import known


@dataclass(frozen=True)
class Panel:
    """Curves on one pair of axes: what was recorded and never fitted, the base, and what was named."""

    title: str
    x: str
    """Label with its unit, as of y."""
    y: str
    recorded: tuple[list[float], list[float]]
    """Along x and along y, as the others."""
    base: tuple[list[float], list[float]]
    named: tuple[list[float], list[float]]


def curve(x, y) -> tuple[list[float], list[float]]:
    """Of a panel, to six digits; what is not finite is left out."""
    x, y = (np.asarray(values, float) for values in (x, y))
    seen = np.isfinite(x) & np.isfinite(y)
    return tuple([float(f"{v:.6g}") for v in values[seen]] for values in (x, y))


@dataclass(frozen=True)
class Found:
    """What the tool made of the recording."""

    verdict: Verdict
    physics: dict[str, Any]
    """physics.json as it stands."""
    panels: tuple[Panel, ...] = ()


@dataclass(frozen=True)
class Answer:
    """One thing asked of a diagnosis, and whether it was met."""

    question: str
    asked: str
    got: str
    met: bool | None
    """None where the diagnosis says nothing that could be held against it."""


@dataclass(frozen=True, kw_only=True)
class Known:
    title: str
    data: str
    """Folder of the data that it needs, below SURGISIM_DATA."""
    concealed: str
    """In words: what the base lacks, and how it is known."""
    convert: Callable[[Path], Any] | None = None
    """The `Recording` that is diagnosed, from the folder of the data."""
    hold_out: Callable[[Path], Any] | None = None
    """Another `Recording` of the same body, which is never fitted."""
    bare: Callable[[Path], Any] | None = None
    """The `Recording` whose diagnosis tells the base, if that is not fitted to the one that is diagnosed."""
    direct: Callable[[Path, Callable[..., None]], Found] | None = None
    """What is found, where the diagnosis of pulled tissue does not apply: from the folder of the data, and progress."""
    ask: Callable[[Path, Found], list[Answer]]
    """The questions, from the folder of the data and what was found."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """What the diagnosis is told beside its defaults."""

    def part(self, name: str) -> Callable[[Path], Any]:
        """What makes the recording, the one held out, or the bare one. Raises Problem where there is none."""
        found = {"recording": self.convert, "hold_out": self.hold_out, "bare": self.bare}[name]
        if found is None:
            raise Problem(f"'{self.title}' has no {name.replace('_', ' ')}. Ask for another part.")
        return found


def catalogue() -> dict[str, Known]:
    """Every known recording by name."""
    found = {}
    for module in pkgutil.iter_modules(known.__path__, f"{known.__name__}."):
        loaded = importlib.import_module(module.name)
        if hasattr(loaded, "KNOWN"):
            found[module.name.rpartition(".")[2]] = loaded.KNOWN
    return found


def chosen(name: str) -> Known:
    every = catalogue()
    if name not in every:
        raise Problem(f"no real recording is called '{name}'; there are {sorted(every)}. Correct the name.")
    return every[name]


def named(verdict: Verdict, wanted: tuple[str, ...], asked: str) -> Answer:
    """Whether one of the wanted laws was named."""
    got = " and ".join(verdict.names) or verdict.verdict
    return Answer("what was left out", asked, got.replace("_", " "), bool(set(verdict.names) & set(wanted)))


def answered(name: str, found: Found, data: Callable[[str], Path]) -> dict[str, Any]:
    """score.json: what was concealed, what was said, and every question with its answer."""
    case = chosen(name)
    answers = case.ask(data(case.data), found)
    return {
        "format": "surgisim-known/1",
        "case": name,
        "title": case.title,
        "concealed": case.concealed,
        "verdict": found.verdict.verdict,
        "named": [{"term": e.term, "probability": e.probability} for e in found.verdict.effects],
        "words": found.verdict.words,
        "answers": [asdict(a) for a in answers],
        "direct": case.direct is not None,
        "panels": [asdict(p) for p in found.panels],
    }
