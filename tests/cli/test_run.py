"""The command line: what it says, what it leaves, and how it goes on."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
import yaml

from surgisim.order import of_diagnosis
from surgisim.problem import Problem


def sentence(done: subprocess.CompletedProcess) -> str:
    """The one line that says what went wrong."""
    said = [line for line in (done.stdout + done.stderr).splitlines() if line.startswith("error: ")]
    assert "Traceback" not in done.stdout + done.stderr
    assert len(said) == 1
    return said[0]


def test_a_clip_goes_through_the_whole_graph_and_the_second_time_through_nothing(tree):
    (tree.root / "my clip.mp4").write_text("frames")
    first = tree.surgisim("run", "my clip.mp4", "--out", "there")
    assert first.returncode == 0
    page = tree.root / "there" / "results" / "my_clip" / "main" / "report" / "report.html"
    assert str(page) in first.stdout
    assert page.is_file()
    assert "nothing to do" in tree.surgisim("run", "my clip.mp4", "--out", "there").stdout


@pytest.mark.slow
def test_all_variants_of_a_table_of_clips_run_in_one_call(tree):
    (tree.root / "two.tsv").write_text("name\tpath\na\tphantom\nb\tphantom\n")
    done = tree.surgisim("run", "two.tsv", "--variant", "all", "--out", "there")
    assert done.returncode == 0
    variants = yaml.safe_load((tree.root / "config" / "variants.yaml").read_text())
    assert done.stdout.count("report.html") == 2 * len(variants)


def test_a_missing_recording_is_one_sentence(tree):
    done = tree.surgisim("run", "nowhere.mp4", "--out", "there")
    assert done.returncode == 2
    assert "nowhere.mp4: no such video" in sentence(done)


@pytest.mark.parametrize(
    ("options", "wanted"),
    [
        (["--set", "ingest.sise=3"], "did you mean 'size'"),
        (["--set", "ingest.size"], "STAGE.KEY=VALUE is wanted"),
        (["--set", "ingest.size=wide"], "key 'ingest.size' is 'wide'"),
        (["--set", "diagnosis.fre=0"], "there is no key 'diagnosis.fre'; did you mean 'free'?"),
        (["--set", "iterations=3"], "did you mean 'reconstruction.iterations' or 'estimation.iterations'?"),
        (["--set", "recon.iterations=3"], "did you mean 'reconstruction'?"),
        (["--set", "grasp=10,20"], "--grasp 10,20: grasp is [10, 20]; X,Y,RADIUS is wanted"),
        (["--set", "grasp=10,20,5,3,1"], "it is let go at 1 s and taken hold of at 3 s; END must be later"),
        (["--variant", "elastc"], "--variant elastc: there is no such variant; did you mean 'elastic'?"),
        (["--until", "recon"], "did you mean 'reconstruction'"),
        (["--until", "maskin"], "did you mean 'masking'"),
        (["--profile", "cloud"], "known by name: default, gpu, slurm"),
        (["--config", "none.yaml"], "none.yaml: no such file"),
    ],
)
def test_a_wrong_option_is_one_sentence_and_leaves_no_result(tree, options, wanted):
    done = tree.surgisim("demo", "--out", "there", *options)
    assert done.returncode == 2
    assert wanted in sentence(done)
    assert not list(tree.root.glob("there/results/demo/*"))


def test_where_nothing_can_be_written_is_one_sentence(tree):
    (tree.root / "film.mp4").touch()
    done = tree.surgisim("demo", "--out", "film.mp4")
    assert done.returncode == 2
    assert "--out film.mp4: nothing can be written there" in sentence(done)


def test_a_cluster_whose_plugin_is_not_installed_is_one_sentence(tree):
    (tree.root / "profile").mkdir()
    (tree.root / "profile" / "config.yaml").write_text("executor: nowhere\njobs: 3\n")
    for more in ([], ["-n"]):
        done = tree.surgisim("demo", "--out", "there", "--profile", "profile", *more)
        assert done.returncode == 2
        assert "the package snakemake-executor-plugin-nowhere is not installed" in sentence(done)
    assert not (tree.root / "there").exists()


def test_what_is_no_recording_folder_is_one_sentence(tree):
    (tree.root / "film.mp4").touch()
    for name, wanted in (("film.mp4", "surgisim run film.mp4 --diagnose"), ("nowhere", "nowhere: no such folder")):
        done = tree.surgisim("diagnose", name, "--out", "there")
        assert done.returncode == 2
        assert wanted in sentence(done)
    assert not (tree.root / "there").exists()


def test_what_a_stage_objects_to_reaches_the_user(tree):
    (tree.root / "broken").write_text("depth")
    done = tree.surgisim("demo", "--out", "there")
    assert done.returncode == 2
    assert sentence(done) == "error: depth demo/main: depth is broken on purpose."
    (tree.root / "broken").unlink()
    assert tree.surgisim("demo", "--out", "there", "--until", "depth").returncode == 0


def test_a_fault_of_the_program_says_so_and_names_the_log(tree):
    depth = tree.root / "stages" / "depth.py"
    depth.write_text("1 / 0\n" + depth.read_text())
    said = sentence(tree.surgisim("demo", "--out", "there"))
    assert "ZeroDivisionError" in said
    assert "logs/demo/main/depth.log" in said


@pytest.mark.parametrize(("number", "wanted"), [(9, "was it killed"), (11, "crashed (a fault of the program")])
def test_a_stage_that_dies_without_a_word_says_what_is_known(tree, number, wanted):
    script = tree.root / "stages" / "phantom.py"
    script.write_text(f"import os\nos.kill(os.getpid(), {number})\n" + script.read_text())
    assert wanted in sentence(tree.surgisim("demo", "--out", "there"))


def test_settings_by_file_and_by_flag_reach_the_stages(tree):
    (tree.root / "mine.yaml").write_text("ingest: {size: 100, tail: 0.3}\n")
    done = tree.surgisim("demo", "--out", "there", "--config", "mine.yaml", "--set", "ingest.size=90", "-n")
    assert done.returncode == 0
    written = (tree.root / "there" / "results" / "run.yaml").read_text()
    assert "size: 90" in written
    assert "tail: 0.3" in written


def test_a_new_operation_is_a_variant_that_shares_everything_before_the_simulation(tree):
    (tree.root / "pull more.json").write_text('{"name": "more", "seconds": 1.0, "do": []}')
    done = tree.surgisim("demo", "--out", "there", "--variant", "main", "--operation", "pull more.json", "-n")
    started = [line for line in done.stdout.splitlines() if "pull_more" in line]
    assert sorted(started) == [f"would run {stage} demo/pull_more" for stage in ("evaluation", "report", "simulation")]


def test_a_clip_may_be_diagnosed_too(tree):
    done = tree.surgisim("run", "phantom", "--name", "mine", "--out", "there", "--diagnose", "-n")
    added = {line for line in done.stdout.splitlines() if "diagnosis" in line or "recorded" in line}
    assert added == {f"would run {job} mine/main" for job in ("recorded", "clip_diagnosis", "clip_diagnosis_report")}
    assert "would run report mine/main" in done.stdout


def test_settings_of_a_diagnosis_are_passed_as_all_others(tree):
    (tree.root / "mine.yaml").write_text("diagnosis: {second: false}\n")
    chosen = ("--config", "mine.yaml", "--set", "diagnosis.free=0")
    done = tree.surgisim("run", "phantom", "--out", "there", "--diagnose", *chosen, "-n")
    assert done.returncode == 0
    assert "would run clip_diagnosis" in done.stdout
    assert "free: 0\n  second: false" in (tree.root / "there" / "results" / "run.yaml").read_text()


def test_the_settings_of_a_recordings_diagnosis_may_leave_out_the_sections_name(tmp_path):
    (tmp_path / "mine.yaml").write_text("diagnosis: {second: false, free: 2}\n")
    for key in ("free", "diagnosis.free"):
        chosen = of_diagnosis((tmp_path / "mine.yaml",), (f"{key}=0", "model_error=0.5"))
        assert (chosen.free, chosen.second, chosen.model_error) == (0, False, 0.5)
    with pytest.raises(Problem, match=r"there is no key 'diagnosis\.fre'; did you mean 'free'"):
        of_diagnosis((), ("fre=0",))


def test_a_package_without_its_checkout_says_what_to_do(tree, tmp_path, monkeypatch):
    monkeypatch.setenv("SURGISIM_HOME", str(tmp_path / "empty"))
    assert "Install from a checkout" in sentence(tree.surgisim("demo", "--out", "there"))


def slow(tree, stage: str) -> None:
    script = tree.root / "stages" / f"{stage}.py"
    script.write_text("import time\ntime.sleep(60)\n" + script.read_text())


def begin(tree, wait_for: str) -> subprocess.Popen:
    """A run in the background, at work in the stage that is slow."""
    command = [sys.executable, "-m", "surgisim.cli", "demo", "--out", "there"]
    child = subprocess.Popen(command, cwd=tree.root, env=tree.environment(), stdout=subprocess.PIPE, text=True)
    log = tree.root / "there" / "logs" / "demo" / "main" / f"{wait_for}.log"
    for _ in range(600):
        if log.exists():
            time.sleep(0.5)
            return child
        time.sleep(0.1)
    raise AssertionError("the slow stage never began")


def test_interrupted_it_stops_its_stages_and_goes_on_the_next_time(tree):
    quick = (tree.root / "stages" / "masking.py").read_text()
    slow(tree, "masking")
    child = begin(tree, "masking")
    below = psutil.Process(child.pid).children(recursive=True)
    os.kill(child.pid, signal.SIGINT)
    assert "goes on" in child.communicate(timeout=30)[0]
    assert child.returncode == 130
    assert not any(process.is_running() for process in below)
    (tree.root / "stages" / "masking.py").write_text(quick)
    done = tree.surgisim("demo", "--out", "there", "--until", "masking")
    assert done.returncode == 0
    assert "ingest demo/main" not in done.stdout


def test_killed_outright_it_goes_on_the_next_time(tree):
    quick = (tree.root / "stages" / "masking.py").read_text()
    slow(tree, "masking")
    child = begin(tree, "masking")
    for process in [psutil.Process(child.pid), *psutil.Process(child.pid).children(recursive=True)]:
        process.kill()
    child.wait()
    (tree.root / "stages" / "masking.py").write_text(quick)
    assert tree.surgisim("demo", "--out", "there", "--until", "masking").returncode == 0


def test_two_runs_at_once_in_one_folder_are_refused(tree):
    slow(tree, "masking")
    child = begin(tree, "masking")
    try:
        assert "another run is at work" in sentence(tree.surgisim("demo", "--out", "there"))
    finally:
        os.kill(child.pid, signal.SIGINT)
        child.wait(30)


def test_doctor_and_terms_answer(tree):
    looked = tree.surgisim("doctor")
    assert looked.returncode == 0
    for thing in ("processor", "memory", "GPU", "torch", "warp", "evaluation.lpips_weights", "masking uses"):
        assert thing in looked.stdout
    laws = tree.surgisim("terms").stdout
    for law in Path(tree.root / "surgisim" / "physics" / "terms").glob("[a-z]*.py"):
        assert law.stem in laws
