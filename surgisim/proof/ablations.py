"""What each part of the method is worth: the same cases diagnosed without it."""

from typing import Any

import numpy as np

from surgisim.problem import Problem

FIGURES = {
    "top1": "named rightly",
    "top2": "among the first two names",
    "false_discovery": "false discovery",
    "alarm": "nothing concealed, called unexplained",
    "wrong_names": "names that are wrong",
    "held_back": "outside the catalogue: held back",
    "place_right": "placed within 1.5 cells",
    "cut": "held-out cut of the oracle's, median",
    "placebo_better": "a placebo was better",
}


def losses(boards: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Each figure of each way over all ratios, and how often cases differ from the method's, which comes first.

    gained, lost: cases that only this way names rightly, and that only the method does; p of McNemar's exact test, in
    which chance would make the two equal. cases: what each way says of every one.
    Raises Problem where two ways did not see the same cases.
    """
    method, *_ = boards
    told = {way: {c["recording"]: c for c in board["cases"]} for way, board in boards.items()}
    answers = {way: {recording: _right(c) for recording, c in found.items()} for way, found in told.items()}
    for way, found in answers.items():
        if found.keys() != answers[method].keys():
            raise Problem(f"ablations: '{way}' and '{method}' were not scored on the same cases. Score them all.")
    rows = [
        {"figure": key, "words": words, "values": {w: b["figures"]["all"][key] for w, b in boards.items()}}
        for key, words in FIGURES.items()
    ]
    changes = {}
    for way, found in answers.items():
        pairs = [(answers[method][r], found[r]) for r in found if found[r] is not None]
        lost, gained = (sum(a == x and b != x for a, b in pairs) for x in (True, False))
        changes[way] = {"lost": lost, "gained": gained, "count": len(pairs), "p": _exact(lost, gained)}
    cases = [
        {
            "case": case["case"],
            "concealed": [effect["term"] for effect in case["concealed"]],
            "snr": case["snr"],
            "said": {way: _said(found[case["recording"]]) for way, found in told.items()},
        }
        for case in boards[method]["cases"]
    ]
    return {"format": "surgisim-ablations/2", "ways": list(boards), "rows": rows, "changes": changes, "cases": cases}


def _said(case: dict[str, Any]) -> dict[str, Any]:
    """What one way's verdict names, with what probability, and whether that is right."""
    return {
        "verdict": case["verdict"],
        "named": [{"term": e["term"], "probability": e["probability"]} for e in case["named"]],
        "right": _right(case),
        "alarm": not case["concealed"] and case["verdict"] == "unexplained",
    }


def _right(case: dict[str, Any]) -> bool | None:
    """Whether the verdict is what it should be, whatever the case conceals."""
    if case["false_discovery"] is not None:
        return not case["false_discovery"]
    return case["top1"] if case["top1"] is not None else case["held_back"]


def _exact(lost: int, gained: int) -> float:
    """Two-sided; McNemar, Psychometrika 12 (1947)."""
    n, k = lost + gained, min(lost, gained)
    if n == 0:
        return 1.0
    ways = np.cumprod([1.0, *((n - i) / (i + 1) for i in range(n))])
    return float(min(1.0, 2 * ways[: k + 1].sum() / 2.0**n))
