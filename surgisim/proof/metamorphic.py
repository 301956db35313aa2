"""What the same recording, told a little differently, changes in a verdict: a question that needs no key."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from surgisim.artifacts.verdict import read_verdict
from surgisim.proof.naming import common
from surgisim.proof.perturb.names import AS_IS
from surgisim.proof.shares import share

FORMAT = "surgisim-metamorphic/1"
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


def metamorphic(folder: Path, names: list[str], perturbations: list[str]) -> dict[str, Any]:
    """Every recording's verdicts beside that of the recording as it is.

    folder: holds NAME/PERTURBATION/diagnosis.json. A diagnosis that is not there counts nowhere.
    """
    rows = [_row(folder, name, perturbations) for name in names]
    told = [name for name in perturbations if name != AS_IS]
    return {
        "format": FORMAT,
        "perturbations": perturbations,
        "recordings": rows,
        "figures": {name: figures(rows, (name,)) for name in told},
        "perturbed": figures(rows, tuple(told)),
    }


def figures(rows: list[dict[str, Any]], names: tuple[str, ...]) -> dict[str, Any]:
    """Shares of verdicts that became a name, lost theirs, or changed it; and how much log evidence changed.

    became: where nothing was named as it is; lost, changed, kept: where something was. change: log evidence of the best
    law less that as it is, and `law` the first named law's own, quantiles and count.
    """
    pairs = [(r["cells"][AS_IS], r["cells"][n]) for r in rows for n in names if {AS_IS, n} <= r["cells"].keys()]
    silent = [new for old, new in pairs if old["law"] is None]
    named = [(old["law"], new["law"]) for old, new in pairs if old["law"] is not None]
    told = {
        "became": share(new["law"] is not None for new in silent),
        "kept": share(old == new for old, new in named),
        "lost": share(new is None for _, new in named),
        "changed": share(new not in (None, old) for old, new in named),
    }
    changes = {
        "change": _spread([_less(new["log_evidence"], old["log_evidence"]) for old, new in pairs]),
        "law": _spread([_less(new["law_evidence"], old["law_evidence"]) for old, new in pairs]),
    }
    return {name: found.told() for name, found in told.items()} | changes


def _row(folder: Path, name: str, perturbations: list[str]) -> dict[str, Any]:
    places = {p: folder / name / p / "diagnosis.json" for p in perturbations}
    return {"recording": name, "cells": {p: cell(path) for p, path in places.items() if path.is_file()}}


def cell(path: Path) -> dict[str, Any]:
    """Verdict, first name, its probability and log evidence, and that of the best law."""
    verdict, told = read_verdict(path), json.loads(path.read_text())
    law = verdict.effects[0] if verdict.names else None
    evidence = [c.log_evidence for c in verdict.ranking if law and c.term == law.term]
    return {
        "verdict": verdict.verdict,
        "law": common(law.term) if law else None,
        "probability": law.probability if law else None,
        "log_evidence": told.get("global_test", {}).get("log_evidence"),
        "law_evidence": told["effects"][0].get("log_evidence", *evidence[:1]) if law else None,
    }


def _less(new: float | None, old: float | None) -> float | None:
    return None if new is None or old is None else new - old


def _spread(changes: list[float | None]) -> dict[str, Any]:
    known = np.array([c for c in changes if c is not None], float)
    if not len(known):
        return {"count": 0, "quantiles": None, "largest": None}
    return {
        "count": len(known),
        "quantiles": dict(zip(map(str, QUANTILES), np.quantile(known, QUANTILES).tolist(), strict=True)),
        "largest": float(np.abs(known).max()),
    }
