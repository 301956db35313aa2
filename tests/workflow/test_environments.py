"""Where jobs find Python: here, in conda's environments, in images; all of them of one lock.

Conda and apptainer are stand-ins that note what they are asked for and then run it with this Python.
"""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from cheap_tree import ROOT

from surgisim.config.whole import rooted
from surgisim.digest import sources
from surgisim.environments import FAMILIES, lock, needed, packages_distributions, scripts, third_parties, written

CONDA = """#!/bin/sh
case "$1 $2" in
  "--version ") echo "conda 24.11.0" ;;
  "info --json") echo '{{"conda_prefix": "{here}", "platform": "linux-64"}}' ;;
  "clean -y" | "config --set") ;;
  "config --get") echo '{{"get": {{"channel_priority": "strict"}}}}' ;;
  "env create")
    while [ "$1" != --file ]; do shift; done
    file=$2
    while [ "$1" != --prefix ]; do shift; done
    mkdir -p "$2/bin"
    head -1 "$file" > "$2/made-of"
    printf '#!/bin/sh\\necho "$(cat %s/made-of) | $*" >> {here}/used\\n{then}\\n' "$2" > "$2/bin/python"
    chmod +x "$2/bin/python" ;;
  *) echo "conda $*: not expected" >&2; exit 9 ;;
esac
"""
APPTAINER = """#!{python}
import os, subprocess, sys
from pathlib import Path
told = sys.argv[1:]
if told == ["--version"]:
    print("apptainer version 1.4.5")
    sys.exit()
shell = max(k for k, word in enumerate(told) if word == "-c") - 1
image, command = told[shell - 1], told[shell + 2]
bound = [told[k + 1] for k, word in enumerate(told[:shell]) if word == "--bind"]
with open("{here}/used", "a") as notes:
    notes.write(f"{{image}} | {{' '.join(bound)}} | {{command}}\\n")
path = f"{here}/bin:{{Path(sys.executable).parent}}:/usr/bin:/bin"
sys.exit(subprocess.run([told[shell], "-c", command], env=os.environ | {{"PATH": path}}).returncode)
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder of stand-ins, first in PATH."""
    (tmp_path / "bin").mkdir()
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:/usr/bin:/bin")
    return tmp_path


def put(path: Path, content: str) -> None:
    path.write_text(content)
    path.chmod(0o755)


def conda(here: Path, then: str) -> None:
    put(here / "bin" / "conda", CONDA.format(here=here, then=then))
    put(here / "bin" / "activate", 'export PATH="$1/bin:$PATH"\n')


def families_of(tree, *arguments: str) -> dict[str, str]:
    """Stage -> family, of all jobs that would run."""
    stages = {m[1] for c in tree.commands(*arguments) if (m := re.search(r"stages/(\w+)\.py", c))}
    return {s: family for family in FAMILIES for path in scripts(family, ROOT) if (s := path.stem) in stages}


def test_what_is_generated_is_up_to_date():
    for name, content in written(ROOT).items():
        assert (ROOT / "envs" / name).read_text() == content, f"{name}: run `make config`"


def test_a_family_has_all_that_its_code_imports_or_it_is_an_extra():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    optional = {re.split("[><=]", name)[0] for names in (extras["cuda"], extras["open3d"]) for name in names}
    known = packages_distributions()
    for family in FAMILIES:
        has = set(needed(family, ROOT))
        for path in {path for script in scripts(family, ROOT) for path in sources(script, ROOT)}:
            for module in third_parties(path) if path.suffix == ".py" else ():
                packages = {re.sub("[-_.]+", "-", p).lower() for p in known.get(module, [module])}
                assert packages & (has | optional), f"{family}: {path} imports {module}"


def test_every_pin_is_of_the_lock_and_every_image_begins_with_a_base_that_can_be_chosen():
    pins = {entry.split(" ")[0] for entries in lock(ROOT).values() for entry in entries}
    for family in FAMILIES:
        found = set(re.findall(r"- ([\w.-]+==\S+)", (ROOT / "envs" / f"{family}.yaml").read_text()))
        assert len(found) > 10
        assert found <= pins
        made = (ROOT / "envs" / f"{family}.Dockerfile").read_text()
        assert "ARG BASE=python:3.11-slim-bookworm\nFROM ${BASE}\n" in made


def test_condas_python_is_the_one_that_runs(tree, here):
    conda(here, f'exec {sys.executable} "$@"')
    assert tree.run("--sdm", "conda") == 0
    used = (here / "used").read_text().splitlines()
    for stage, family in families_of(tree, "--forceall").items():
        mine = [line.split(" | ")[0] for line in used if f"stages/{stage}.py" in line]
        assert mine, stage
        assert set(mine) == {(tree.root / "envs" / f"{family}.yaml").read_text().splitlines()[0]}


def test_where_condas_python_fails_the_run_does(tree, here):
    conda(here, "exit 7")
    assert "error" in tree.says("--sdm", "conda").lower()
    assert not list(tree.out.glob("results/*/*/*/*.npz"))


def images(tree, here) -> dict[str, str]:
    made = {}
    for family in FAMILIES:
        (here / f"{family}.sif").touch()
        made[family] = str(here / f"{family}.sif")
    return made


def test_each_stage_runs_in_its_image_with_the_checkout_and_the_recording_bound(tree, here, tmp_path):
    put(here / "bin" / "apptainer", APPTAINER.format(python=sys.executable, here=here))
    (tmp_path / "films").mkdir()
    (tmp_path / "films" / "mine.mp4").write_bytes(b"film")
    (tmp_path / "clips.tsv").write_text("name\tpath\nmine\tfilms/mine.mp4\n")
    tree.choices = {"containers": images(tree, here), "clips": str(tmp_path / "clips.tsv")}
    assert tree.run("--sdm", "apptainer") == 0
    used = (here / "used").read_text().splitlines()
    for stage, family in families_of(tree, "--forceall").items():
        mine = [line for line in used if f"stages/{stage}.py" in line]
        assert mine, stage
        for line in mine:
            image, bound, command = line.split(" | ", 2)
            assert Path(image).name == f"{family}.sif"
            assert {str(tree.root), str(tmp_path / "films")} <= set(bound.split())
            assert str(Path(sys.executable).parent) not in command


def test_condas_environments_lie_in_images_where_both_are_asked_for(tree, here):
    conda(here, f'exec {sys.executable} "$@"')
    put(here / "bin" / "apptainer", APPTAINER.format(python=sys.executable, here=here))
    tree.choices = {"containers": images(tree, here)}
    assert tree.run("--sdm", "conda", "apptainer") == 0
    used = (here / "used").read_text().splitlines()
    for stage, family in families_of(tree, "--forceall").items():
        mine = [line for line in used if f"stages/{stage}.py" in line]
        assert sum(line.startswith(f"{here}/{family}.sif | ") and "bin/activate" in line for line in mine), stage
        assert sum(line.startswith("# ") for line in mine), f"{stage} did not run with conda's python"


def test_an_image_that_is_not_named_or_not_there_is_said(tree, here):
    put(here / "bin" / "apptainer", APPTAINER.format(python=sys.executable, here=here))
    assert "'containers.physics' is empty" in tree.says("--sdm", "apptainer")
    tree.choices = {"containers": dict.fromkeys(FAMILIES, "nowhere.sif")}
    assert "nowhere.sif is no file or folder. Build the image from envs/" in tree.says("--sdm", "apptainer")


def test_another_workflow_uses_this_one_as_a_module(tree, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    (other / "Snakefile").write_text(
        f"module surgery:\n    snakefile: '{tree.root}/workflow/Snakefile'\n    config: {{'run': ['main']}}\n\n"
        "use rule * from surgery as surgery_*\n\n"
        "rule mine:\n    default_target: True\n    input: rules.surgery_all.input\n    output: 'done'\n"
        "    shell: 'touch {output}'\n"
    )
    command = [sys.executable, "-m", "snakemake", "--cores", "2", "--directory", str(other / "out")]
    said = subprocess.run(command, cwd=other, env=tree.environment(), capture_output=True, text=True)
    assert said.returncode == 0, said.stderr[-2000:]
    assert (other / "out" / "done").exists()
    assert (other / "out" / "results" / "summary.html").exists()


def test_an_image_lies_beside_the_config_that_names_it_and_an_address_is_left_alone():
    told = {"containers": {"scene": "a.sif", "report": "docker://here/b:1"}}
    assert rooted(told, Path("/mine")) == {"containers": {"scene": "/mine/a.sif", "report": "docker://here/b:1"}}


def test_recordings_that_are_diagnosed_as_they_are_are_bound(tree, here, tmp_path):
    put(here / "bin" / "apptainer", APPTAINER.format(python=sys.executable, here=here))
    (tmp_path / "seen" / "one").mkdir(parents=True)
    tree.choices = {"containers": images(tree, here), "recordings": [str(tmp_path / "seen" / "one")]}
    assert tree.run("--sdm", "apptainer") == 0
    assert all(
        str(tmp_path / "seen") in line.split(" | ")[1].split() for line in (here / "used").read_text().splitlines()
    )
