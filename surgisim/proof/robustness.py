"""Whether verdicts stay when a recording says something a frame, a millimetre or a per cent differently."""

import json
from pathlib import Path
from typing import Any

from surgisim.artifacts.verdict import Verdict, read_verdict
from surgisim.problem import Problem
from surgisim.proof.naming import SURE, common
from surgisim.proof.perturb.names import AS_IS
from surgisim.proof.shares import share

FORMAT = "surgisim-robustness/1"
LAWS = (
    "active_contraction", "added_mass", "base_layer", "damage", "fibre", "gravity", "plastic_set", "pretension",
    "relaxation", "respiration", "sliding_base", "stiff_inclusion", "tool_slip",
)  # fmt: skip
"""Effects that most bodies bear at a signal-to-noise ratio of 3 and more."""
RATIO = 3.0
"""Least signal-to-noise ratio asked of them [1]."""
Cell = dict[str, Any]


def robustness(
    folder: Path, bodies: list[int], perturbations: list[str], diagnoses: Path | None = None
) -> dict[str, Any]:
    """Every verdict of `folder` against what its body conceals, and shares for each perturbation.

    folder: holds BODY/sealed/truth.json and BODY/PERTURBATION/diagnosis.json, unless `diagnoses` holds the latter. A
    diagnosis that is not there is no cell, and counts nowhere.
    """
    rows = [_row(folder, diagnoses or folder, body, perturbations) for body in bodies]
    return {
        "format": FORMAT,
        "perturbations": perturbations,
        "bodies": rows,
        "figures": {name: figures(rows, (name,)) for name in perturbations},
        "perturbed": figures(rows, tuple(n for n in perturbations if n != AS_IS)),
    }


def figures(rows: list[dict[str, Any]], names: tuple[str, ...]) -> dict[str, Any]:
    """Shares with Wilson's intervals over all bodies and the perturbations `names`.

    silent: nothing detectable, of bodies that conceal nothing; false_names: a law named there. Of bodies that conceal a
    law: right, withdrawn, wrong (another law named), and wrong_sure (with a probability above SURE); kept, lost and
    turned: of those named rightly as they are, still named so, no longer named, and named otherwise; turned_sure.
    """
    empty = [c for r in rows if r["concealed"] is None for n in names if (c := r["cells"].get(n))]
    laws = [(r, c) for r in rows if r["concealed"] is not None for n in names if (c := r["cells"].get(n))]
    firm = [c for r, c in laws if r["cells"].get(AS_IS, {}).get("outcome") == "right"]
    told = {
        "silent": share(c["outcome"] == "silent" for c in empty),
        "false_names": share(c["outcome"] == "wrong" for c in empty),
        "right": share(c["outcome"] == "right" for _, c in laws),
        "withdrawn": share(c["outcome"] == "withdrawn" for _, c in laws),
        "wrong": share(c["outcome"] == "wrong" for _, c in laws),
        "wrong_sure": share(c["outcome"] == "wrong" and c["probability"] > SURE for _, c in laws),
        "kept": share(c["outcome"] == "right" for c in firm),
        "lost": share(c["outcome"] == "withdrawn" for c in firm),
        "turned": share(c["outcome"] == "wrong" for c in firm),
        "turned_sure": share(c["outcome"] == "wrong" and c["probability"] > SURE for c in firm),
    }
    return {name: found.told() for name, found in told.items()}


def cell(verdict: Verdict, concealed: str | None) -> Cell:
    """One verdict against the law concealed, None for nothing.

    outcome: silent or alarm where nothing is concealed, right or withdrawn where a law is, wrong where another is said.
    """
    given = [common(term) for term in verdict.names]
    if given:
        # An equivalence class is right where it holds the truth.
        right = concealed is not None and (
            concealed == given[0] or (verdict.verdict == "equivalence class" and concealed in given)
        )
        outcome = "right" if right else "wrong"
    elif concealed is None:
        outcome = "silent" if verdict.verdict == "nothing detectable" else "alarm"
    else:
        outcome = "withdrawn"
    return {
        "outcome": outcome,
        "verdict": verdict.verdict,
        "law": given[0] if given else None,
        "probability": verdict.effects[0].probability if given else None,
    }


def _row(folder: Path, diagnoses: Path, body: int, perturbations: list[str]) -> dict[str, Any]:
    truth = json.loads((folder / str(body) / "sealed" / "truth.json").read_text())
    if len(truth["effects"]) > 1:
        raise Problem(f"{folder / str(body)}: conceals two laws, but bodies of none or one are wanted. Take another.")
    concealed = truth["effects"][0]["term"] if truth["effects"] else None
    places = {name: diagnoses / str(body) / name / "diagnosis.json" for name in perturbations}
    cells = {name: cell(read_verdict(path), concealed) for name, path in places.items() if path.is_file()}
    return {"body": body, "recording": truth["recording"], "concealed": concealed, "snr": truth["snr"], "cells": cells}


def bodies(seed: int, count: int) -> list[int]:
    """Cases of a seed's mixture, of LAWS alone: first a third that conceal nothing, then a law each, by turn."""
    from surgisim.phantom.mixture import concealed

    empty, single, case = [], [], 0
    while len(empty) < count // 3 or len(single) < count - count // 3:
        names = concealed(seed, case, LAWS)
        if len(names) < 2:
            (single if names else empty).append(case)
        case += 1
    return empty[: count // 3] + single[: count - count // 3]
