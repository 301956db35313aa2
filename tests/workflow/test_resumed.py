"""A diagnosis that the graph runs goes on where it was interrupted."""

import pytest

MADE = """
import sys
from pathlib import Path

for path in (Path(flag) for flag in sys.argv[1:] if "/" in flag and not flag.startswith("{")):
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("made")
sys.exit()
"""
"""A stage that writes whatever is not there."""

DIAGNOSIS = """
import os
import signal
import sys
from pathlib import Path

import numpy as np

from surgisim.diagnosis.memo import Memo

told = dict(zip(sys.argv[1::2], sys.argv[2::2]))
memo = Memo(Path(told["--work"]), told["--settings"])


def run(name):
    with open("journal", "a") as stream:
        stream.write(name + " ")
    return {"seen": np.ones(3)}


memo("first run", lambda: run("first"))
Path(told["--diagnosis"]).write_text("begun")
if not Path("killed").exists():
    Path("killed").touch()
    os.kill(os.getpid(), signal.SIGKILL)
memo("second run", lambda: run("second"))
for key in ("--diagnosis", "--physics", "--mismatch", "--cloud"):
    Path(told[key]).write_text("done")
sys.exit()
"""
"""A diagnosis of two runs that is killed between them when it is started first."""


@pytest.mark.parametrize("folder", ["results/demo/main/diagnosis", "blind/5/0/main", "known/beam_damping"])
def test_a_diagnosis_that_was_killed_keeps_its_runs_and_once_it_is_done_none(tree, folder):
    (tree.root / "config" / "clips.tsv").write_text("name\tpath\ndemo\tphantom\n")
    tree.choices = {"cases": 1, "seed": 5}
    for stage in ("recorded", "invent", "seals", "known", "diagnosis"):
        script = tree.root / "stages" / f"{stage}.py"
        script.write_text((DIAGNOSIS if stage == "diagnosis" else MADE) + script.read_text())
    made = tree.out / folder
    assert tree.run("--keep-going", f"{folder}/diagnosis.json") != 0
    assert not (made / "diagnosis.json").exists()
    assert len(list((made / "work").iterdir())) == 1
    assert tree.run("--keep-going", f"{folder}/diagnosis.json") == 0
    assert (tree.out / "journal").read_text().split() == ["first", "second"]
    assert (made / "mismatch.ply").read_text() == "done"
    assert not (made / "work").exists()
