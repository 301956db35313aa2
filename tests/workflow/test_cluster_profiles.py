"""The profiles of a cluster: what they ask of it for which stage. .ci/cluster runs one of them on one node."""

import re

import yaml
from cheap_tree import ROOT

PROFILES = ROOT / "workflow" / "profiles"
COMPUTED = {"reconstruction", "scene_again", "estimation", "simulation"}
"""Rules that compute on a GPU where they are given one."""


def profile(name: str) -> dict:
    return yaml.safe_load((PROFILES / name / "config.yaml").read_text())


def test_both_differ_in_nothing_but_gpus_and_the_time_they_save():
    plain, on_gpu = profile("slurm"), profile("slurm-gpu")
    assert {rule for rule, asked in on_gpu["set-resources"].items() if asked.pop("gpu", 0)} == COMPUTED
    for told in (plain, on_gpu):
        for asked in told["set-resources"].values():
            assert re.fullmatch(r"\d+\*attempt", asked["mem_mb"])
            assert re.fullmatch(r"\d+\*attempt", asked.pop("runtime"))
    assert plain == on_gpu
    assert plain["retries"] >= 1
    assert plain["keep-going"]


def test_a_gpu_is_asked_for_by_exactly_the_stages_that_compute_on_one(tree):
    asked, devices = {}, {}
    for command in tree.commands("--profile", str(PROFILES / "slurm-gpu"), "all", "tables"):
        stage, device = re.search(r"stages/(\w+)\.py", command), re.search(r'"device": "(\w+)"', command)
        if stage:
            asked.setdefault(stage[1], set()).add('lease.py" 1' in command)
            devices.setdefault(stage[1], set()).add(device and device[1])
    # Scenes that are fitted again are the same stage's.
    assert {stage for stage, found in asked.items() if found == {True}} == COMPUTED - {"scene_again"}
    assert {stage for stage, found in devices.items() if "cuda" in found} == COMPUTED - {"scene_again"}
    assert all(len(found) == 1 for found in (*asked.values(), *devices.values()))


def test_on_processors_alone_no_gpu_is_asked_for(tree):
    assert not any(
        '"device": "cuda"' in command or 'lease.py" 1' in command
        for command in tree.commands("--profile", str(PROFILES / "slurm"), "all", "tables")
    )


def test_memory_grows_with_each_attempt_everywhere():
    for rules in (ROOT / "workflow" / "rules").glob("*.smk"):
        assert not re.search(r"mem_mb=\d", rules.read_text()), rules.name
