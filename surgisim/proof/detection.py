"""How strong an effect must be to be named: over all laws in ranges of the ratio, and as a curve for each."""

import itertools
from typing import Any

import numpy as np

from surgisim.proof.shares import share

EDGES = (0.5, 1.0, 1.5, 2.0, 3.0, 4.5, 10.0)
RATIOS = np.geomspace(0.25, 8.0, 41)
"""Signal to noise [1] at which a curve is told."""
THRESHOLDS = np.log(np.geomspace(0.15, 15.0, 141))
MIDDLES, SPREADS = THRESHOLDS[::6], np.array([0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.5])
WIDTHS, LAPSES = np.array([0.06, 0.1, 0.16, 0.25, 0.4, 0.6]), np.array([0.0, 0.02, 0.05, 0.1, 0.2])
QUANTILES = (0.025, 0.5, 0.975)
Point = dict[str, Any]


def detection(cases: list[dict[str, Any]]) -> dict[str, Any]:
    """The probability of the right name against the ratio: every single case, and false alarms at ratio 0."""
    points = [
        {
            "term": c["concealed"][0]["term"],
            "snr": c["snr"],
            "right": c["top1"],
            "probability": c["probability_of_truth"],
            "recording": c["recording"],
        }
        for c in cases
        if c["kind"] == "one"
    ]
    bins = []
    for low, high in itertools.pairwise(EDGES):
        mine = [p for p in points if low <= p["snr"] < high]
        if mine:
            mean = sum(p["snr"] for p in mine) / len(mine)
            bins.append({"from": low, "to": high, "snr": mean, **share(p["right"] for p in mine).told()})
    alarms = share(c["false_discovery"] for c in cases).told()
    return {"points": points, "bins": bins, "laws": curves(points), "false_alarms": alarms}


def curves(points: list[Point]) -> list[dict[str, Any]]:
    """Each law's probability of being named against the ratio [1], with 95 % intervals, of few cases a law.

    A logistic curve of the ratio's logarithm below a ceiling. All laws share its width and its ceiling; thresholds
    differ, normal around a middle, so that a law of two cases leans on the others and its interval says so. Every
    number lies on a grid, whose sums are the posterior: nothing is drawn, nothing iterates. threshold: the ratio at
    which half of the ceiling is reached; of eight cases a law, its interval holds what was planted in 91 %. After
    Kuss, Jaekel and Wichmann, Bayesian inference for psychometric functions, Journal of Vision 5 (2005).
    """
    terms = sorted({p["term"] for p in points})
    if not terms:
        return []
    # Axes: law, width, lapse, threshold; then width, lapse, middle, spread.
    fits = np.exp([_log_likelihood([p for p in points if p["term"] == term]) for term in terms])
    around = np.exp(-0.5 * ((THRESHOLDS - MIDDLES[:, None, None]) / SPREADS[:, None]) ** 2)
    around /= around.sum(-1, keepdims=True)
    each = np.log(np.einsum("twlm,abm->twlab", fits, around))
    rows = []
    for t, term in enumerate(terms):
        others = each.sum(0) - each[t]
        weight = fits[t] * np.einsum("wlab,abm->wlm", np.exp(others - others.max()), around)
        weight /= weight.sum()
        low, middle, high = _quantiles(np.broadcast_to(THRESHOLDS, weight.shape), weight)
        named = np.stack([_named(x) for x in np.log(RATIOS)])
        ends = [_quantiles(values, weight) for values in named]
        rows.append(
            {
                "term": term,
                "count": sum(p["term"] == term for p in points),
                "threshold": {"value": float(np.exp(middle)), "low": float(np.exp(low)), "high": float(np.exp(high))},
                "snr": RATIOS.tolist(),
                "value": [float((values * weight).sum()) for values in named],
                "low": [e[0] for e in ends],
                "high": [e[2] for e in ends],
            }
        )
    return rows


def _named(log_ratio: float) -> np.ndarray:
    """(widths, lapses, thresholds): probability of the right name at a ratio, at every point of the grid."""
    rise = 1 / (1 + np.exp(-(log_ratio - THRESHOLDS) / WIDTHS[:, None]))
    return (1 - LAPSES)[:, None] * rise[:, None, :]


def _log_likelihood(points: list[Point]) -> np.ndarray:
    """(widths, lapses, thresholds), the largest 0."""
    total = np.zeros((len(WIDTHS), len(LAPSES), len(THRESHOLDS)))
    for p in points:
        chance = _named(float(np.log(p["snr"])))
        total += np.log(chance if p["right"] else 1 - chance + 1e-300)
    return total - total.max()


def _quantiles(values: np.ndarray, weight: np.ndarray) -> tuple[float, float, float]:
    """QUANTILES of what has these weights, which sum to one."""
    order = np.argsort(values, axis=None)
    sums = np.cumsum(weight.ravel()[order])
    at = np.searchsorted(sums, QUANTILES)
    found = values.ravel()[order][np.minimum(at, len(order) - 1)]
    return float(found[0]), float(found[1]), float(found[2])
