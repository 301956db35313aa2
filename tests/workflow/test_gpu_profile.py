"""The gpu profile's shares of a machine of 16 processors."""

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


def test_only_what_computes_on_a_gpu_waits_for_one():
    profile = yaml.safe_load(PROFILE.read_text())
    on_gpu = {line.split("=")[0] for line in profile["config"] if "device: cuda" in line} | {"scene_again"}
    assert set(profile["set-resources"]) == on_gpu
