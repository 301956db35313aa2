"""Leave one generator out: what is learned of all families but one, and what holds on that one.

Three numbers are learned of scored cases, none of them of the family that they are scored on:

    least     log evidence below which nothing is called hidden: few of the others' empty cases reach it
    heat      power 1 / heat to which stated probabilities are raised, so that the others' truths are likeliest
    sure      probability below which a law is not named: few of the others' names above it are wrong

They can withhold what a diagnosis says, and restate how sure it is; they never name another law.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from surgisim.artifacts.verdict import Effect, Verdict
from surgisim.problem import Problem
from surgisim.proof.board import figures, strong
from surgisim.proof.calibration import calibration, of_names
from surgisim.proof.naming import NOT_NAMED, naming
from surgisim.proof.shares import wilson

FORMAT = "surgisim-across/1"
ALARMS = 0.05
"""Most of the empty cases that may be called anything but empty; chosen, as the goal for them is."""
WRONG = 0.10
"""Most of the names that may be wrong; chosen."""
HEATS = np.geomspace(0.5, 20.0, 60)
TINY = 1e-9
"""Least probability that a truth is taken to have had."""
Case = dict[str, Any]


@dataclass(frozen=True)
class Learned:
    least: float
    heat: float
    sure: float


PLAIN = Learned(-math.inf, 1.0, 0.0)
"""As diagnosed."""


def learn(cases: list[Case]) -> Learned:
    """Of scored cases; what they do not tell stays as diagnosed."""
    empty = sorted((c["evidence"] for c in cases if c["kind"] == "nothing" and c["evidence"] is not None), reverse=True)
    # As many may be above it as leave their share at most ALARMS when one more were.
    spare = math.floor(ALARMS * (len(empty) + 1))
    least = max(empty[spare] + TINY, 0.0) if len(empty) > spare else PLAIN.least
    single = [c for c in cases if c["kind"] == "one" and c["stated"]]
    heat = float(min(HEATS, key=lambda h: _surprise(single, h))) if single else 1.0
    told = [(heated(c["stated"], heat).get(_first(c), 0.0), not any(c["wrong_names"])) for c in cases if c["named"]]
    return Learned(least, heat, _sure(sorted(told, reverse=True)))


def _surprise(cases: list[Case], heat: float) -> float:
    """Negative log likelihood of what is concealed."""
    truths = [(heated(c["stated"], heat), c["concealed"][0]["term"]) for c in cases]
    return -sum(math.log(max(p.get(name, 0.0), TINY)) for p, name in truths)


def _first(case: Case) -> str:
    return case["named"][0]["term"]


def _sure(told: list[tuple[float, bool]]) -> float:
    """Least probability above which at most WRONG of the names are wrong, most probable first."""
    fits = [p for k, (p, _) in enumerate(told) if sum(not right for _, right in told[: k + 1]) <= WRONG * (k + 1)]
    if not told:
        return PLAIN.sure
    return min(fits) if fits else 1.0


def heated(stated: dict[str, float], heat: float) -> dict[str, float]:
    """Probabilities raised to 1 / heat, of sum 1 as before."""
    powers = {name: p ** (1 / heat) for name, p in stated.items() if p > 0}
    whole, before = sum(powers.values()), min(sum(stated.values()), 1.0)
    return {name: before * p / whole for name, p in powers.items()}


def withheld(case: Case, learned: Learned) -> Case:
    """The case with what is learned laid over its verdict."""
    stated = heated(case["stated"], learned.heat)
    verdict, named = case["verdict"], case["named"]
    if case["evidence"] is not None and case["evidence"] < learned.least:
        verdict, named = NOT_NAMED[0], []
    elif named and stated.get(_first(case), 0.0) < learned.sure:
        verdict, named = NOT_NAMED[1], []
    effects = tuple(Effect(e["term"], stated.get(e["term"], 0.0)) for e in named)
    names = tuple(c["term"] for c in case["concealed"])
    blank = Verdict(case["recording"], verdict, effects, (), None, (), {}, {}, None, "")
    said = naming(case["kind"], names, blank)
    kept = {k: said[k] for k in ("verdict", "named", "wrong_names", "class_holds", "probability", "abstained", "top1",
                                 "both", "false_discovery", "held_back")}  # fmt: skip
    silent = {} if effects else {"places": [], "onsets": [], "parameters": []}
    return case | {"stated": stated} | kept | silent


def across(boards: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Every family as diagnosed, and with what is learned of the others. boards: family -> its scoreboard.

    Raises Problem for fewer than two families.
    """
    if len(boards) < 2:
        raise Problem(f"blind_across: one is left out of at least two families, and {list(boards)} is given.")
    rows, kept = [], []
    for family, board in boards.items():
        others = [c for name, b in boards.items() if name != family for c in b["cases"]]
        learned = learn(others)
        mine = [withheld(c, learned) for c in board["cases"]]
        kept += mine
        rows.append({
            "family": family, "learned_of": len(others),
            "learned": {k: v if math.isfinite(v) else None for k, v in vars(learned).items()},
            "plain": _figures(board["cases"]), "kept": _figures(mine),
        })  # fmt: skip
    every = [c for b in boards.values() for c in b["cases"]]
    return {
        "format": FORMAT,
        "families": rows,
        "pooled": {"plain": _figures(every), "kept": _figures(kept)},
        "calibration": {"plain": calibration(of_names(every)), "kept": calibration(of_names(kept))},
        "cases": [_row(c) for c in every],
    }


def _row(case: Case) -> dict[str, Any]:
    kept = {name: case[name] for name in ("case", "kind", "evidence", "verdict", "named")}
    hidden = [e["term"] for e in case["concealed"]]
    return kept | {"family": case.get("family", "blocks"), "concealed": hidden, "oracle": case.get("log_evidence")}


def _figures(cases: list[Case]) -> dict[str, Any]:
    """Of what is strong and what is empty; the upper end of false discovery is of a 95 % interval."""
    found = figures(strong(cases))
    empty = [c for c in cases if c["kind"] == "nothing"]
    alarms = sum(bool(c["named"]) for c in empty)
    return found | {"empty": len(empty), "false_discovery_high": wilson(alarms, len(empty))[1]}
