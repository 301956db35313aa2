"""The gpu profile's shares of a machine of 16 processors."""

import re
from pathlib import Path

import pytest
import yaml

PROFILE = Path(__file__).parents[2] / "workflow" / "profiles" / "gpu" / "config.yaml"
PROCESSORS = 16


@pytest.mark.parametrize(("long", "beside"), [("correspondence", "inpainting"), ("tracking", "reconstruction")])
def test_what_needs_nothing_of_each_other_runs_side_by_side(long, beside):
    threads = yaml.safe_load(PROFILE.read_text())["set-threads"]
    # What the profile does not name has the rule's own two.
    assert threads[long] + threads.get(beside, 2) <= PROCESSORS


def test_what_has_a_gpu_computes_on_it_whatever_else_is_chosen(tree):
    # Snakemake drops a profile's own `config` where there is any on the command line.
    tree.choices = {"run": ["main"], "reconstruction": {"seed": 3}}
    on_gpu = set(yaml.safe_load(PROFILE.read_text())["set-resources"])
    placed = {}
    for command in tree.commands("--profile", str(PROFILE.parent), "all", "tables"):
        stage, device = re.search(r"stages/(\w+)\.py", command), re.search(r'"device": "(\w+)"', command)
        if stage:
            placed.setdefault(stage[1], set()).add((device and device[1], 'lease.py" 1' in command))
    on = {stage for stage, ways in placed.items() if ways == {("cuda", True)}}
    assert on == on_gpu - {"scene_again"}
    assert not any(device == "cuda" for stage in placed.keys() - on for device, _ in placed[stage])


def test_without_the_profile_everything_is_on_processors(tree):
    assert not any(
        '"device": "cuda"' in command or 'lease.py" 1' in command for command in tree.commands("all", "tables")
    )
