"""Coverage counts what it should."""

from surgisim.artifacts.metrics import Metrics
from surgisim.proof.coverage import coverage, in_words, plain
from surgisim.report.charts.intervals import intervals


def clip(name: str, low: float, told: bool) -> Metrics:
    entry = {"value": low + 1, "low": low, "high": low + 2, "true": 5.0, "inside": low <= 5 <= low + 2, "told": told}
    return Metrics(
        name, "main", {"physics": {"corotated.E": entry | {"unit": "Pa"}, "told_inside": {"value": 1.0}}}, {}
    )


def test_only_what_is_told_counts_for_the_share_inside():
    result = coverage([clip("a", 4, True), clip("b", 4.5, True), clip("c", 9, True), clip("d", 9, False)])
    E = result["parameters"]["E"]
    assert (E["held"]["hits"], E["held"]["count"]) == (2, 3)
    assert (E["told"]["hits"], E["told"]["count"]) == (3, 4)
    assert E["held_of_all"]["count"] == 4
    assert E["bias"]["value"] == (4.5 + 1 - 5) / 5
    assert "inside 2/3" in in_words(result)
    assert intervals(result).startswith(b"\x89PNG")


def test_without_clips_nothing_is_claimed():
    assert coverage([])["parameters"] == {}


def test_names_lose_their_law_and_keep_the_rest():
    assert plain("newtonian.eta / corotated.E") == "eta / E"
    assert plain("grip 0.toward") == "grip 0.toward"
