"""A law's detection curve from few cases: it finds planted thresholds, and its intervals are honest."""

import numpy as np
import pytest

from surgisim.proof.detection import curves


def recorded(thresholds, cases, rng, width=0.2, lapse=0.03):
    """Cases of each law named by a logistic curve in the ratio's logarithm."""
    points = []
    for term, threshold in thresholds.items():
        for snr in np.exp(rng.uniform(np.log(0.4), np.log(6.0), cases)):
            named = (1 - lapse) / (1 + np.exp(-np.log(snr / threshold) / width))
            points.append({"term": term, "snr": float(snr), "right": bool(rng.random() < named)})
    return points


def test_planted_thresholds_are_found():
    planted = {"fibre": 0.9, "gravity": 1.6, "tether": 3.0}
    found = {row["term"]: row for row in curves(recorded(planted, 300, np.random.default_rng(1)))}
    for term, threshold in planted.items():
        assert found[term]["threshold"]["value"] == pytest.approx(threshold, rel=0.12)
        assert found[term]["value"][-1] == pytest.approx(0.97, abs=0.03)


def test_intervals_of_eight_cases_hold_what_was_planted():
    rng, inside = np.random.default_rng(2), []
    for _ in range(12):
        planted = dict(zip("abcdefgh", np.exp(rng.normal(0.4, 0.4, 8)), strict=True))
        for row in curves(recorded(planted, 8, rng)):
            inside.append(row["threshold"]["low"] <= planted[row["term"]] <= row["threshold"]["high"])
    assert np.mean(inside) >= 0.86


def test_a_law_of_one_case_leans_on_the_others_and_says_so():
    rng = np.random.default_rng(3)
    points = recorded(dict.fromkeys("abcdef", 1.5), 40, rng)
    rows = {r["term"]: r for r in curves([*points, {"term": "z", "snr": 2.0, "right": True}])}
    ratio = {term: row["threshold"]["high"] / row["threshold"]["low"] for term, row in rows.items()}
    assert 1.0 < rows["z"]["threshold"]["value"] < 2.0
    assert ratio["z"] > 1.2 * max(ratio[t] for t in "abcdef")


def test_a_curve_rises_and_lies_in_its_band():
    (row,) = curves([{"term": "fibre", "snr": s, "right": s > 1.5} for s in (0.5, 1.0, 2.0, 3.0)])
    assert (np.diff(row["value"]) > 0).all()
    assert all(a <= v <= b for a, v, b in zip(row["low"], row["value"], row["high"], strict=True))
    assert curves([]) == []
