"""All cases together: shares with what they are worth, and that nothing but the paths tells the law."""

import csv
import io
import json
import re

import numpy as np
import pytest
from proof import made_up
from proof.made_up import diagnosis, effect, named
from proof.test_score import scored

from surgisim.problem import Problem
from surgisim.proof.ablations import losses
from surgisim.proof.board import pooled, scoreboard, weaker, with_metadata
from surgisim.proof.calibration import calibration
from surgisim.proof.case import phases
from surgisim.proof.chance import chance
from surgisim.proof.metadata import features, tells
from surgisim.proof.shares import share, wilson
from surgisim.proof.shorten import shortened
from surgisim.proof.shuffle import partner, shuffled
from surgisim.report.board.ablations import page as ablations_page
from surgisim.report.board.page import page, table

LAWS = ("stiff_inclusion", "tether", "fibre", "relaxation")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Eight cases: five with one law of which four are named, one empty, one with two, one outside."""
    root, cases = tmp_path_factory.mktemp("run"), []
    plans = [("one", (LAWS[i % 4],), LAWS[i % 4] if i else "fibre", 4.0) for i in range(5)]
    plans += [
        ("nothing", (), None, 0.0),
        ("two", LAWS[:2], LAWS[0], 2.0),
        ("outside", ("swelling",), "unexplained", 4.0),
    ]
    for i, (kind, hidden, said, ratio) in enumerate(plans):
        name, verdict = f"r-{i}", {None: "nothing detectable", "unexplained": "unexplained"}.get(said, "named")
        told = diagnosis(name, verdict, (named(said, 0.8),) if verdict == "named" else (), ranking=[])
        effects = tuple(effect(h, outside_catalogue=kind == "outside") for h in hidden)
        extra = 3e-4 * ratio
        cases.append(
            scored(root / name, name=name, kind=kind, effects=effects, snr=ratio, extra=extra, told=told, case=i)
        )
    return root, cases


def test_the_board_counts_what_the_cases_say(run):
    board = scoreboard(run[1])
    strong = board["figures"]["strong"]
    assert board["kinds"] == {"nothing": 1, "one": 5, "two": 1, "outside": 1}
    assert (strong["top1"]["hits"], strong["top1"]["count"]) == (4, 5)
    assert (strong["false_discovery"]["hits"], strong["false_discovery"]["count"]) == (0, 1)
    assert (strong["held_back"]["hits"], strong["two_both"]["count"]) == (1, 0)
    assert board["figures"]["all"]["two_both"]["count"] == 1
    assert {g["figure"]: g["met"] for g in board["goals"]} == {
        "top1": True, "top2": False, "false_discovery": True, "held_back": True, "place_right": True, "cut": True,
        "placebo_better": True,
    }  # fmt: skip


def test_effects_that_tracks_show_less_than_they_were_made_to_stand_out_are_reported_apart(run):
    lost, kept = ({**case, "snr": ratio, "snr_set": 4.0} for case, ratio in zip(run[1][:2], (1.2, 4.0), strict=True))
    empty = {**run[1][5], "snr_set": 0.0}
    assert weaker([lost, kept, empty]) == [lost]
    board = scoreboard([lost, kept, empty])
    assert board["figures"]["weaker"]["top1"]["count"] == board["figures"]["strong"]["top1"]["count"] == 1
    shown = page(board).decode()
    assert "In 1 case the effect was made to stand out" in shown
    assert "1.2 <small>(4.0)</small>" in shown
    assert "was made to stand out" not in page(scoreboard([kept, empty])).decode()


def test_every_case_is_in_the_confusion_once(run):
    found = scoreboard(run[1])["confusion"]
    assert sum(map(sum, found["counts"])) == len(run[1])
    assert found["rows"][-1] == "nothing"
    at = found["rows"].index("stiff_inclusion"), found["columns"].index("fibre")
    assert found["counts"][at[0]][at[1]] == 1


def test_a_case_is_not_scored_twice(run):
    with pytest.raises(Problem, match="scored twice"):
        scoreboard([*run[1], run[1][0]])


def test_the_boards_of_several_seeds_are_one(run):
    _, cases = run
    seeds = [scoreboard(part) | {"seals": 5} for part in (cases[:3], cases[3:])]
    both, whole = pooled(seeds), scoreboard(cases)
    assert both["seals"] == 10
    assert {k: both[k] for k in both if k != "seals"} == {k: whole[k] for k in whole if k != "seals"}
    with pytest.raises(Problem, match="scored twice"):
        pooled([seeds[0], seeds[0]])
    with pytest.raises(Problem, match="board 2: 'format' is None"):
        pooled([seeds[0], {}])


def test_an_interval_of_few_cases_is_wide():
    assert wilson(5, 10) == pytest.approx((0.2366, 0.7634), abs=1e-4)
    assert (wilson(0, 4)[0], wilson(4, 4)[1], wilson(0, 0)) == (0.0, 1.0, (0.0, 1.0))
    assert share([True, None, False]).count == 2


def test_intervals_hold_the_truth_nineteen_times_of_twenty():
    rng = np.random.default_rng(3)
    hits = rng.binomial(40, 0.7, 4000)
    inside = [low <= 0.7 <= high for low, high in (wilson(int(h), 40) for h in hits)]
    assert np.mean(inside) == pytest.approx(0.95, abs=0.02)


def test_probabilities_that_mean_what_they_say_are_calibrated():
    rng = np.random.default_rng(0)
    stated = rng.random(4000)
    honest = calibration([(p, bool(rng.random() < p)) for p in stated])
    boasting = calibration([(p, bool(rng.random() < p * p)) for p in stated])
    assert honest["expected_error"] < 0.03 < 0.1 < boasting["expected_error"]
    assert all(b["low"] <= b["stated"] <= b["high"] for b in honest["bins"])


def test_dealing_verdicts_at_random_brings_naming_to_chance(run):
    real = chance(run[1])
    assert real["real"] > real["value"] + 0.2
    assert real["p"] < 0.1
    names = [c["ranked"] for c in run[1]]
    blind = [c | {"ranked": names[(i + 1) % 5], "top1": None if c["top1"] is None else names[(i + 1) % 5][0] in
                  {h["term"] for h in c["concealed"]}} for i, c in enumerate(run[1][:5])]  # fmt: skip
    assert chance(blind)["p"] > 0.2


def test_what_lies_in_the_files_tells_nothing_unless_it_does(run):
    root, cases = run
    board = with_metadata(cases, [root / c["recording"] / "recording" for c in cases])
    assert board["metadata"]["law"]["p"] > 0.01
    rows = [features(root / c["recording"] / "recording") for c in cases] * 5
    labels = [c["kind"] for c in cases] * 5
    rng = np.random.default_rng(0)
    rows = [r | {"frames": rng.normal(), "visible": rng.normal(), "size of tracks.npz": rng.normal()} for r in rows]
    assert tells(rows, list(rng.permutation(labels)))["p"] > 0.01
    given_away = [r | {"frames": 100.0 * hash_of(label)} for r, label in zip(rows, labels, strict=True)]
    assert tells(given_away, labels)["p"] < 0.01


def hash_of(label: str) -> float:
    return float(sum(label.encode()))


def test_rounded_positions_are_noticed(tmp_path):
    made_up.case(tmp_path)
    path = tmp_path / "recording" / "tracks.npz"
    arrays = dict(np.load(path))
    exact = features(tmp_path / "recording")["last byte zero"]
    arrays["points"] = arrays["points"].astype(np.float16).astype(np.float32)
    np.savez_compressed(path, **arrays)
    assert exact < 0.1 < features(tmp_path / "recording")["last byte zero"]


def test_shuffled_paths_belong_to_another_body():
    assert sorted(partner(i, 7, 3) for i in range(7)) == list(range(7))
    assert all(partner(i, 7, 3) != i for i in range(7))
    own, other = made_up.recording("r-own", seed=1), made_up.recording("r-other", extra=5e-3, seed=2)
    mixed = shuffled(own, other)
    assert (mixed.name, mixed.fps, mixed.frames) == ("r-own", own.fps, own.frames)
    assert (mixed.attached() == own.attached()).all()
    moved = np.nanmax(np.linalg.norm(mixed.points - mixed.attached()[:, None], axis=-1))
    assert moved == pytest.approx(
        np.nanmax(np.linalg.norm(other.points - other.attached()[:, None], axis=-1)), rel=1e-3
    )
    assert (mixed.visible == other.visible).all()


def test_a_shorter_clip_lacks_what_comes_later():
    whole = made_up.recording()
    assert phases(whole) == ["rest", "load", "hold", "release"]
    assert phases(shortened(whole, "hold")) == ["rest", "load", "hold"]
    assert phases(shortened(whole, "load")) == ["rest", "load"]
    assert shortened(whole, "load").split["held_out"] == whole.split["held_out"]


def test_the_page_needs_nothing_beside_itself_and_the_table_has_every_case(run):
    board = scoreboard(run[1]) | {"pages": "../{case}/main/diagnosis.html"}
    text = page(board).decode()
    links = re.findall(r"""(?:src|href)="([^"]+)""", text)
    assert all(k.startswith(("data:", "#", "../")) for k in links)
    assert "../3/main/diagnosis.html" in text
    assert page(board).decode() == text
    rows = list(csv.DictReader(io.StringIO(table(board).decode())))
    assert [r["recording"] for r in rows] == [c["recording"] for c in board["cases"]]
    assert json.loads(json.dumps(board, allow_nan=False))["count"] == 8


def test_what_a_part_is_worth_is_what_is_lost_without_it(run):
    cases = run[1]
    worse = [c | {"top1": False} if c["top1"] and c["case"] in (1, 2) else c for c in cases]
    worse = [c | {"verdict": "unexplained"} if c["kind"] == "nothing" else c for c in worse]
    found = losses({"main": scoreboard(cases), "iid": scoreboard(worse)})
    assert found["changes"]["iid"] == {"lost": 2, "gained": 0, "count": 8, "p": 0.5}
    assert found["changes"]["main"]["p"] == 1.0
    alarms = next(row["values"] for row in found["rows"] if row["figure"] == "alarm")
    assert [alarms[way]["hits"] for way in ("main", "iid")] == [0, 1]
    empty = found["cases"][5]
    assert (empty["concealed"], empty["said"]["main"]["alarm"], empty["said"]["iid"]["alarm"]) == ([], False, True)
    text = ablations_page(found).decode()
    assert "residuals taken as independent" in text
    assert text.count('<td class="no">unexplained') == 1
    with pytest.raises(Problem, match="not scored on the same cases"):
        losses({"main": scoreboard(cases), "iid": scoreboard(worse[1:])})
