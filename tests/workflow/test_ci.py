"""What CI runs exists, and those who fork run the same."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
SCRIPTS = sorted(p for p in (ROOT / ".ci").iterdir() if p.suffix == "")
WORKFLOW = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text())
STEPS = [step for job in WORKFLOW["jobs"].values() for step in job["steps"]]
TARGETS = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.M))


def parses(text: str) -> bool:
    return subprocess.run(["bash", "-n"], input=text, text=True, capture_output=True).returncode == 0


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.name)
def test_scripts_can_be_run_and_parsed(path):
    assert path.stat().st_mode & 0o111
    assert parses(path.read_text())


def test_all_that_is_called_exists():
    said = "\n".join(step.get("run", "") for step in STEPS) + (ROOT / ".ci" / "run").read_text()
    assert set(re.findall(r"^\s*make ([\w-]+)", said, re.M)) <= TARGETS
    called = set(re.findall(r"\.ci/(\w+)", said))
    assert called >= {"containers", "cluster"}
    assert called - {"run"} <= {path.name for path in SCRIPTS}


def test_each_step_is_one_action_of_a_named_version_or_a_command_that_parses():
    # "on" is a truth value in YAML 1.1, which GitHub does not follow.
    assert set(WORKFLOW) == {"name", True, "permissions", "concurrency", "env", "jobs"}
    for step in STEPS:
        assert ("uses" in step) != ("run" in step)
        assert re.fullmatch(r"[\w-]+/[\w-]+@v\d+", step.get("uses", "a/b@v1"))
        assert parses(step.get("run", ""))


def test_both_run_every_test_and_the_style():
    run, forks = (ROOT / ".ci" / "run").read_text(), "\n".join(step.get("run", "") for step in STEPS)
    for said, tests in ((run, ["test-all"]), (forks, ["test", "test-slow"])):
        for target in ("setup", "lint", *tests):
            assert re.search(rf"^make {target}( TORCH=\S+)?$", said, re.M), target


def test_forks_take_the_torch_that_is_locked():
    locked = re.search(r"^TORCH=\$\{TORCH:-(\S+)\}", (ROOT / "envs" / "setup.sh").read_text(), re.M)[1]
    assert WORKFLOW["env"]["TORCH"].split()[0] == locked


def test_a_machine_that_is_too_slow_leaves_slow_tests_out_and_says_so(tmp_path):
    shutil.copy(ROOT / "tests" / "conftest.py", tmp_path)
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers = slow(seconds)\n")
    body = "import pytest\n\n@pytest.mark.slow(99)\ndef test_long(): pass\n\ndef test_short(): pass\n"
    (tmp_path / "test_some.py").write_text(body)
    command = [sys.executable, "-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider", str(tmp_path)]
    said = {}
    for until in ("1", "inf"):
        ran = subprocess.run(command, env=os.environ | {"SLOW_TESTS_UNTIL": until}, capture_output=True, text=True)
        assert ran.returncode == 0, ran.stdout + ran.stderr
        said[until] = ran.stdout
    assert "1 passed, 1 skipped" in said["1"]
    assert "NOT BEGUN" in said["1"]
    assert "2 passed" in said["inf"]
