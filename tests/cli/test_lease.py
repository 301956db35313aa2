"""GPUs are lent one job at a time."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

LEASE = Path(__file__).parents[2] / "workflow" / "lease.py"
SHOW = "import os, time; print(os.environ['CUDA_VISIBLE_DEVICES'], flush=True); time.sleep(float(os.sys.argv[1]))"


@pytest.fixture
def lend(tmp_path):
    environment = os.environ | {"CUDA_VISIBLE_DEVICES": "3,5", "TMPDIR": str(tmp_path)}
    environment.pop("SLURM_JOB_ID", None)

    def start(count: int, seconds: float = 0.0, at_once: int = 2) -> subprocess.Popen:
        command = [sys.executable, str(LEASE), str(count), sys.executable, "-c", SHOW, str(seconds)]
        told = environment | {"SURGISIM_GPU_JOBS": str(at_once)}
        return subprocess.Popen(command, env=told, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    return start


def test_a_job_without_a_gpu_sees_none(lend):
    assert lend(0).communicate()[0].strip() == ""


def test_two_jobs_get_different_gpus_and_a_third_waits(lend):
    first, second = lend(1, 3.0), lend(1, 3.0)
    held = {job.stdout.readline().strip() for job in (first, second)}
    assert held == {"3", "5"}
    began = time.monotonic()
    assert lend(1).communicate()[0].strip() in held
    assert time.monotonic() - began > 0.5
    first.wait(), second.wait()


def test_more_jobs_at_once_than_gpus_share_them_evenly(lend):
    jobs = []
    for gpu in ("3", "5", "3", "5"):
        jobs.append(lend(1, 5.0, at_once=4))
        assert jobs[-1].stdout.readline().strip() == gpu
    assert lend(2, at_once=4).communicate()[0].strip() in ("3,5", "5,3")
    assert all(job.wait() == 0 for job in jobs)


def test_a_killed_job_gives_its_gpus_back(lend):
    job = lend(2, 60.0)
    assert job.stdout.readline().strip() == "3,5"
    job.kill()
    job.wait()
    assert lend(2).communicate(timeout=20)[0].strip() == "3,5"


def test_more_gpus_than_there_are_is_one_sentence(lend):
    job = lend(3)
    assert "3 GPUs are wanted and this machine shows 2" in job.communicate()[1]
    assert job.returncode == 1
