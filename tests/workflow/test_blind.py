"""Concealed recordings: the order in which answers are fixed, diagnoses made, and truths opened."""

import re
import subprocess
import sys

import pytest

JOB = re.compile(r"^(?:local)?rule (\w+):\n(?:    input: (.*)\n)?(?:    output: (.*)\n)?", re.M)


@pytest.fixture
def jobs(tree):
    """(rule, inputs, outputs) of every job that a dry run of a target would start."""

    def planned(target: str) -> list[tuple[str, list[str], list[str]]]:
        command = [sys.executable, "-m", "snakemake", "--snakefile", str(tree.root / "workflow" / "Snakefile")]
        command += ["--directory", str(tree.root), "--cores", "1", "--dry-run", target, "--config", "cases=3", "seed=5"]
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


@pytest.mark.parametrize("target", ["blind", "blind_shuffled", "blind_ablations"])
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
