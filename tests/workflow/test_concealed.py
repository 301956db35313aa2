"""Concealed recordings: the order in which answers are fixed, diagnoses made, and truths opened."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from cheap_tree import Tree
from links import dead

ROOT = Path(__file__).parents[2]
JOB = re.compile(r"^(?:local)?rule (\w+):\n(?:    input: (.*)\n)?(?:    output: (.*)\n)?", re.M)


@pytest.fixture
def jobs(tree):
    """(rule, inputs, outputs) of every job that a dry run of a target would start."""

    shutil.copy(Path(__file__).with_name("stand_in.py"), tree.root / "stages" / "diagnosis.py")

    def planned(target: str, *more: str) -> list[tuple[str, list[str], list[str]]]:
        command = [sys.executable, "-m", "snakemake", "--snakefile", str(tree.root / "workflow" / "Snakefile")]
        command += [
            "--directory",
            str(tree.root),
            "--cores",
            "1",
            "--dry-run",
            target,
            "--config",
            "cases=3",
            "seed=5",
            *more,
        ]
        said = subprocess.run(command, env=tree.environment(), capture_output=True, text=True, timeout=120)
        assert said.returncode == 0, said.stdout + said.stderr
        return [
            (rule, *(part.split(", ") if part else [] for part in (inputs, outputs)))
            for rule, inputs, outputs in JOB.findall(said.stdout)
        ]

    return planned


def above(made: dict[str, list[str]], path: str) -> set[str]:
    """Every file that `path` is made from, however far up."""
    found, waiting = set(), [path]
    while waiting:
        more = set(made.get(waiting.pop(), ())) - found
        found |= more
        waiting += more
    return found


@pytest.mark.parametrize("target", ["blind", "blind_shuffled", "blind_ablations", "blind_phases"])
def test_no_diagnosis_has_a_sealed_file_among_what_it_reads(jobs, target):
    planned = jobs(target)
    made = {out: inputs for _, inputs, outputs in planned for out in outputs}
    diagnoses = [(inputs, outputs) for rule, inputs, outputs in planned if rule == "diagnosis"]
    assert diagnoses
    for inputs, outputs in diagnoses:
        assert not [path for path in above(made, outputs[0]) if "/sealed/" in path]
        assert not [path for path in inputs if "truth" in path or "salt" in path]


def test_no_diagnosis_starts_before_all_answers_are_sealed(jobs):
    planned = jobs("blind")
    (seals,) = [(inputs, outputs) for rule, inputs, outputs in planned if rule == "seals"]
    assert sorted(seals[0]) == [f"blind/5/{case}/seal.txt" for case in range(3)]
    for rule, inputs, _ in planned:
        if rule in ("diagnosis", "score"):
            assert seals[1][0] in inputs
        if rule not in ("invent", "score"):
            assert not [path for path in inputs if "/sealed/" in path], rule


def test_a_clip_that_conceals_goes_through_the_graph_and_only_its_score_opens_the_truth(jobs):
    planned = jobs("blind", "tier=video")
    made = {out: inputs for _, inputs, outputs in planned for out in outputs}
    rules = [rule for rule, *_ in planned]
    for rule in ("invent_clip", "ingest", "tracking", "estimation", "recorded", "diagnosis", "score"):
        assert rules.count(rule) == 3, rule
    assert not {"invent", "phantom", "simulation"} & set(rules)
    assert made["results/video-5-1/main/ingest/frames.npz"] == ["blind/video-5/1/clip.mp4"]
    for rule, inputs, outputs in planned:
        if rule not in ("invent_clip", "score"):
            assert not [path for path in inputs if "/sealed/" in path], rule
        if rule == "diagnosis":
            assert not [path for path in above(made, outputs[0]) if "/sealed/" in path]
            assert "blind/video-5/seals.txt" in inputs
            assert "results/video-5-1/main/tracking/tracks.npz" in above(made, "blind/video-5/1/main/diagnosis.json")
    (scored,) = (inputs for rule, inputs, outputs in planned if "blind/video-5/1/main/score.json" in outputs)
    assert {"blind/video-5/1/sealed/truth.json", "results/video-5-1/main/ingest/camera.json"} <= set(scored)


def test_a_tier_that_nobody_knows_is_one_sentence(tree):
    tree.choices = {"cases": 1, "seed": 5, "tier": "film"}
    assert (
        "config key 'tier' is 'film'; ['tracks', 'video', 'tetrahedra', 'springs', 'lattice'] are known."
        in tree.says("--dry-run", "blind")
    )


def test_a_family_invents_in_a_folder_of_its_own_and_its_name_goes_to_whoever_invents_alone(jobs):
    planned = jobs("blind", "tier=springs")
    rules = [rule for rule, *_ in planned]
    assert (rules.count("invent"), rules.count("diagnosis"), rules.count("score")) == (3, 3, 3)
    (seals,) = [inputs for rule, inputs, _ in planned if rule == "seals"]
    assert sorted(seals) == [f"blind/springs-5/{case}/seal.txt" for case in range(3)]
    for rule, inputs, _ in planned:
        assert rule in ("invent", "score") or not [path for path in inputs if "/sealed/" in path]


def test_one_generator_left_out_takes_every_family_s_board(jobs):
    (across,) = [inputs for rule, inputs, _ in jobs("blind_across") if rule == "across"]
    families = ("", "tetrahedra-", "springs-", "lattice-")
    assert across == [f"blind/{family}5/main/scoreboard.json" for family in families]


def test_shuffled_paths_are_another_cases(jobs):
    lent = {
        o[0].split("/")[2]: {path.split("/")[2] for path in i}
        for rule, i, o in jobs("blind_shuffled")
        if rule == "shuffle"
    }
    assert all(len(cases) == 2 and own in cases for own, cases in lent.items())
    assert set.union(*(cases - {own} for own, cases in lent.items())) == set("012")


def test_a_mistake_in_what_is_invented_is_one_sentence(tree):
    tree.choices = {"cases": 1, "seed": 5, "invent": {"pionts": 3}}
    assert "there is no key 'pionts'; did you mean 'points'?" in tree.says("--dry-run", "blind")


@pytest.mark.parametrize("target", ["blind", "blind_real"])
def test_a_mistake_in_the_settings_of_a_diagnosis_is_one_sentence(tree, target):
    tree.choices = {"cases": 1, "seed": 5, "diagnosis": {"fre": 0}}
    assert "there is no key 'diagnosis.fre'; did you mean 'free'?" in tree.says("--dry-run", target)


@pytest.mark.slow
def test_a_run_is_invented_sealed_diagnosed_opened_and_scored(tmp_path):
    for name in ("surgisim", "stages", "workflow", "config", "envs"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(Path(__file__).with_name("stand_in.py"), tmp_path / "stages" / "diagnosis.py")
    tree, out = Tree(tmp_path, tmp_path / "out"), tmp_path / "out" / "blind" / "4"
    few = {
        "points": 30,
        "spacing": 0.0055,
        "spacing_coarse": 0.0065,
        "only": ["fibre"],
        "snr_low": 1.0,
        "snr_high": 2.0,
    }
    tree.choices = {"cases": 1, "seed": 4, "invent": few}
    assert tree.run("--keep-going", "blind") == 0
    board = json.loads((out / "main" / "scoreboard.json").read_text())
    assert (board["count"], board["seals"], board["seeds"]) == (1, 1, [4])
    assert board["cases"][0]["verdict"] == "named"
    files = [out / name for name in ("0/sealed/truth.json", "seals.txt", "0/main/diagnosis.json", "0/main/score.json")]
    assert sorted(files, key=lambda path: path.stat().st_mtime_ns) == files
    assert "../0/main/diagnosis.html" in (out / "main" / "scoreboard.html").read_text()
    assert dead(out / "main" / "scoreboard.html") == []
    assert not tree.plan("blind") - {("blind",)}
    # One more case: what was diagnosed stays.
    tree.choices = {**tree.choices, "cases": 2}
    again = {job for job in tree.plan("blind") if job[0] in ("diagnosis", "invent")}
    assert again == {("invent", "4", "1"), ("diagnosis", "4", "1", "main")}
    # Somebody changes the answer afterwards.
    tree.choices = {**tree.choices, "cases": 1}
    answer = out / "0" / "sealed" / "truth.json"
    answer.write_text(answer.read_text().replace('"noise": 0.0003', '"noise": 0.0001'))
    assert tree.run("--keep-going", "blind") != 0
    said = (tree.out / "logs" / "blind" / "4" / "0" / "main" / "score.log").read_text()
    assert "does not have the seal that was published before the diagnosis" in said
    assert not (out / "0" / "main" / "score.json").exists()


@pytest.mark.slow(450)
def test_a_real_case_goes_from_its_seal_to_a_score(tmp_path):
    for name in ("surgisim", "stages", "workflow", "config", "envs"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    tree = Tree(tmp_path, tmp_path / "out")
    few = {"points": 80, "spacing": 0.004, "spacing_coarse": 0.005, "only": ["stiff_inclusion"]}
    # One law, on one grid, will do.
    tree.choices = {
        "cases": 1,
        "seed": 4,
        "invent": few | {"snr_low": 3.0, "snr_high": 5.0},
        "diagnosis": {
            "workers": 1,
            "free": 0,
            "second": False,
            "nulls": 8,
            "grid": 0.23,
            "replay": 0.23,
            "experiment": False,
            "residual": False,
        },
    }
    assert tree.run("--set-threads", "diagnosis=1", "--keep-going", "blind") == 0
    out = tmp_path / "out" / "blind" / "4"
    board = json.loads((out / "main" / "scoreboard.json").read_text())
    assert (board["count"], board["seals"]) == (1, 1)
    (local,) = board["cases"]
    assert [one["term"] for one in local["concealed"]] == ["stiff_inclusion"]
    assert local["held_out"]["after"] < local["held_out"]["before"]
    assert local["top1"]
    assert local["places"][0]["right"]
