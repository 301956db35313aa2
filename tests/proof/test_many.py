"""Many diagnoses side by side: what is run, passed over, ended, and told."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from made_up import recording

from surgisim.problem import Problem
from surgisim.proof import many
from surgisim.recordings.folder import write_recording

HEAVY = ("torch", "matplotlib", "typer", "snakemake", "cv2", "jinja2", "skimage", "av", "yaml", "PIL")


def test_a_list_is_read_as_a_shell_would_and_what_is_wrong_is_said():
    first, second = many.jobs_of("a b grid=0.2 # coarse\n\n'a c' d\n", ("workers=1",))
    assert first.sets == ("workers=1", "grid=0.2")
    assert (str(second.recording), second.sets) == ("a c", ("workers=1",))
    with pytest.raises(Problem, match="line 1"):
        many.jobs_of("a")
    with pytest.raises(Problem, match="twice"):
        many.jobs_of("a b\nc b\n")


def test_what_is_done_is_passed_over_and_what_cannot_be_done_is_said(tmp_path):
    write_recording(recording(), tmp_path / "made")
    told = {
        "verdict": "named",
        "effects": [{"term": "fibre", "probability": 0.9}],
        "global_test": {"log_evidence": 40.0},
    }
    (tmp_path / "done").mkdir()
    (tmp_path / "done" / "diagnosis.json").write_text(json.dumps(told))
    todo = tmp_path / "todo.txt"
    todo.write_text(f"{tmp_path}/made {tmp_path}/done\n{tmp_path}/missing {tmp_path}/failed\n")
    assert many.main(["--list", str(todo), "--jobs", "2", "--summary", str(tmp_path / "all.json")]) == 1
    done, failed = json.loads((tmp_path / "all.json").read_text())
    assert done["state"] == "passed over"
    assert (done["law"], done["probability"], done["log_evidence"]) == ("fibre", 0.9, 40.0)
    assert failed["state"] == "failed"
    assert "missing: no such folder" in failed["words"]
    assert "fibre (0.90), log evidence 40.0" in many.line(done, 1, 2)


def test_what_takes_too_long_is_ended_and_the_rest_goes_on(tmp_path):
    write_recording(recording(), tmp_path / "made")
    jobs = [many.Job(tmp_path / "made", tmp_path / name) for name in ("a", "b")]
    rows = list(many.carried_out(jobs, side_by_side=2, limit=0.05))
    assert [row["state"] for row in rows] == ["late", "late"]


def test_a_bare_machine_is_enough():
    probe = (
        f"import sys\nfor name in {HEAVY}: sys.modules[name] = None\n"
        "import surgisim.proof.many, surgisim.diagnosis.files, surgisim.diagnosis.diagnose\n"
        "import surgisim.proof.perturb.catalogue, surgisim.proof.robustness\n"
    )
    subprocess.run([sys.executable, "-c", probe], check=True, cwd=Path(__file__).parents[2])
