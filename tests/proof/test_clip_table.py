"""The table of clips counts what it says, and calls nothing better than it is."""

import pytest

from surgisim.artifacts.metrics import Metrics
from surgisim.problem import Problem
from surgisim.proof.clip_table import clip_table, in_words
from surgisim.report.charts.clips import clips


def run(clip: str, variant: str, ours: float, *, still: float = 10.0, rigid: float = 8.0) -> Metrics:
    def entry(value: float) -> dict:
        return {"value": value, "low": 0.95 * value, "high": 1.05 * value, "count": 50, "unit": "px", "protocol": "p"}

    start = "tracked_held_out_pull_moving"
    entries = {"": ours, "_still": still, "_rigid": rigid, "_of_still": 10 * ours, "_of_rigid": 100 * ours / rigid}
    values = {f"{start}{name}_px": entry(value) for name, value in entries.items()}
    return Metrics(clip, variant, {"simulation": values}, {})


def test_ours_is_the_best_only_where_it_is():
    table = clip_table(
        [
            *(run("a", "main", 3.0), run("a", "elastic_default", 6.0), run("a", "near_light", 5.0)),
            *(run("b", "main", 7.8), run("b", "elastic_default", 9.0)),
            *(run("c", "main", 7.0), run("c", "elastic_default", 5.0)),
        ]
    )
    a, b, c = table["rows"]
    assert (a["best"], b["best"], c["best"]) == ("ours", "ours", "default")
    assert (a["surely_best"], b["surely_best"]) == (True, False)
    assert (table["best"], table["surely_best"], table["within_goal"]) == (2, 1, 1)
    assert a["changed"]["near_light"]["change"] == pytest.approx(2.0)
    assert "best in 2 of 3" in in_words(table)
    assert clips(table).startswith(b"\x89PNG")


def test_the_best_default_is_the_one_to_beat():
    runs = [run("a", "main", 3.0), run("a", "elastic_default", 6.0), run("a", "no_estimation", 2.5)]
    (row,) = clip_table(runs)["rows"]
    assert (row["default_is"], row["best"]) == ("no_estimation", "default")
    assert list(row["changed"]) == ["elastic_default"]


def test_a_clip_without_a_number_is_a_row_all_the_same():
    table = clip_table([Metrics("lost", "main", {}, {})])
    assert table["clips"] == 1
    assert table["rows"][0]["best"] is None
    assert "lost" in in_words(table)


def test_one_run_twice_is_refused():
    with pytest.raises(Problem, match="two runs"):
        clip_table([run("a", "main", 3.0), run("a", "main", 4.0)])
