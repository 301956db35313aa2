"""Whether stated probabilities are what they say: of all names given 80 %, 80 % should be right."""

import numpy as np

from surgisim.proof.naming import common
from surgisim.proof.shares import share

EDGES = (0.0, 0.2, 0.4, 0.6, 0.8, 0.9, 1.0)


def calibration(pairs: list[tuple[float, bool]]) -> dict:
    """Reliability in bins with counts and Wilson intervals, Brier score and expected calibration error.

    pairs: probability stated, and whether it was right. Brier, Verification of forecasts expressed in terms of
    probability, Monthly Weather Review 78 (1950); Naeini, Cooper and Hauskrecht, AAAI 2015, for the expected error.
    """
    if not pairs:
        return {"count": 0, "bins": [], "brier": None, "expected_error": None}
    stated, right = np.array([p for p, _ in pairs]), np.array([r for _, r in pairs], bool)
    where = np.clip(np.searchsorted(EDGES, stated, "right") - 1, 0, len(EDGES) - 2)
    bins = []
    for b in range(len(EDGES) - 1):
        mine = where == b
        if mine.any():
            found = share(right[mine]).told() | {"stated": float(stated[mine].mean())}
            bins.append({"from": EDGES[b], "to": EDGES[b + 1], **found})
    gap = sum(b["count"] * abs(b["value"] - b["stated"]) for b in bins) / len(pairs)
    return {
        "count": len(pairs),
        "bins": bins,
        "brier": float(((stated - right) ** 2).mean()),
        "expected_error": float(gap),
    }


def of_names(cases: list[dict]) -> list[tuple[float, bool]]:
    """Every law that a verdict names: its probability, and whether it is concealed in that case."""
    pairs = []
    for case in cases:
        hidden = {c["term"] for c in case["concealed"]}
        pairs += [(e["probability"], common(e["term"]) in hidden) for e in case["named"]]
    return pairs


def of_candidates(cases: list[dict]) -> list[tuple[float, bool]]:
    """Every name that was given any probability, named or not; the unlikely many are in it too."""
    return [(p, t in {c["term"] for c in case["concealed"]}) for case in cases for t, p in case["stated"].items()]
