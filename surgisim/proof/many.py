"""Diagnose many recordings side by side on one machine, without Snakemake.

    python -m surgisim.proof.many --jobs 16 --list todo.txt --summary done.json [--set KEY=VALUE] [--gpus 0,1]

Each line of the list names a recording folder, an output folder and any settings, KEY=VALUE, as a shell would read
them. A diagnosis is a process of its own with one thread (`workers=1` unless a setting says otherwise). What has a
diagnosis.json is passed over, so that an interrupted run goes on. Needs numpy, scipy, warp and pydantic alone.
"""

import argparse
import json
import os
import queue
import shlex
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from surgisim.problem import Problem

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
LOG = "diagnosis.log"


@dataclass(frozen=True)
class Job:
    recording: Path
    out: Path
    sets: tuple[str, ...] = ()
    """KEY=VALUE of the diagnosis' settings; a later one wins."""


def jobs_of(text: str, sets: tuple[str, ...] = ()) -> list[Job]:
    """The jobs of a list's lines, each with `sets` before its own. Raises Problem for a line that is none."""
    jobs = []
    for n, line in enumerate(text.splitlines(), 1):
        words = shlex.split(line, comments=True)
        if not words:
            continue
        if len(words) < 2 or any("=" not in word for word in words[2:]):
            raise Problem(
                f"line {n} of the list is {line!r}; a recording, an output folder, then KEY=VALUE are wanted."
            )
        jobs.append(Job(Path(words[0]), Path(words[1]), (*sets, *words[2:])))
    twice = [str(job.out) for k, job in enumerate(jobs) if any(job.out == other.out for other in jobs[:k])]
    if twice:
        raise Problem(f"the list writes {twice[0]} twice. Give every diagnosis a folder of its own.")
    return jobs


def carried_out(
    jobs: list[Job], *, side_by_side: int, limit: float, gpus: tuple[str, ...] = ()
) -> Iterator[dict[str, Any]]:
    """One row a job, as each ends. `limit` [s] ends a diagnosis; GPUs are dealt out to whatever runs."""
    free: queue.SimpleQueue[str | None] = queue.SimpleQueue()
    for n in range(side_by_side):
        free.put(gpus[n % len(gpus)] if gpus else None)

    def on_a_place(job: Job) -> dict[str, Any]:
        gpu = free.get()
        try:
            return one(job, limit, gpu)
        finally:
            free.put(gpu)

    with ThreadPoolExecutor(side_by_side) as pool:
        waiting = [pool.submit(on_a_place, job) for job in jobs]
        try:
            for done in as_completed(waiting):
                yield done.result()
        finally:
            pool.shutdown(cancel_futures=True)


def one(job: Job, limit: float, gpu: str | None = None) -> dict[str, Any]:
    """Diagnose in a process of its own; state: finished, passed over, failed, or late."""
    row = {"recording": str(job.recording), "out": str(job.out), "seconds": 0.0}
    if (job.out / "diagnosis.json").is_file():
        return row | {"state": "passed over"} | said(job.out)
    job.out.mkdir(parents=True, exist_ok=True)
    begun = time.monotonic()
    with open(job.out / LOG, "wb") as log, _process(job, gpu, log) as process:
        try:
            code = process.wait(limit)
        except subprocess.TimeoutExpired:
            return row | {"state": "late", "seconds": time.monotonic() - begun}
    row["seconds"] = time.monotonic() - begun
    if code or not (job.out / "diagnosis.json").is_file():
        last = (job.out / LOG).read_text(errors="replace").strip().splitlines()[-1:]
        return row | {"state": "failed", "words": last[0] if last else f"ended with code {code}"}
    return row | {"state": "finished"} | said(job.out)


def said(out: Path) -> dict[str, Any]:
    """What a diagnosis says in short: verdict, first law, its probability, log evidence of the best law."""
    told = json.loads((out / "diagnosis.json").read_text())
    first = (told["effects"] or [{}])[0]
    return {
        "verdict": told["verdict"],
        "law": first.get("term"),
        "probability": first.get("probability"),
        "log_evidence": told.get("global_test", {}).get("log_evidence"),
    }


def line(row: dict[str, Any], done: int, whole: int) -> str:
    """One row in words."""
    said = row.get("verdict") or row.get("words") or ""
    if row.get("law"):
        said += f", {row['law']} ({row['probability']:.2f})"
    if row.get("log_evidence") is not None:
        said += f", log evidence {row['log_evidence']:.1f}"
    return f"{done}/{whole} {row['state']:<11} {row['seconds']:6.0f} s  {row['out']}  {said}"


def _setting(said: str) -> tuple[str, Any]:
    """A key and its value, of KEY=VALUE."""
    key, _, value = said.partition("=")
    try:
        return key, json.loads(value)
    except json.JSONDecodeError:
        return key, value


@contextmanager
def _process(job: Job, gpu: str | None, log: Any) -> Iterator[subprocess.Popen]:
    """A diagnosis of its own; whatever happens, nothing of it goes on."""
    environment = os.environ | dict.fromkeys(ONE_THREAD, "1") | {"PYTHONHASHSEED": "0"}
    if gpu is not None:
        environment["CUDA_VISIBLE_DEVICES"] = gpu
    command = [sys.executable, "-m", "surgisim.proof.many", "--one", str(job.recording), str(job.out)]
    process = subprocess.Popen([*command, *job.sets], env=environment, stdout=log, stderr=subprocess.STDOUT)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()


def main(arguments: Iterable[str] | None = None) -> int:
    cli = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    cli.add_argument("--list", type=Path, help="file of lines: RECORDING OUT [KEY=VALUE ...]")
    cli.add_argument("--jobs", type=int, default=os.cpu_count(), help="diagnoses side by side")
    cli.add_argument("--limit", type=float, default=7200.0, help="seconds after which one is ended")
    cli.add_argument("--gpus", default="", help="devices to deal out, as 0,1; the setting device=cuda uses them")
    cli.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="a setting of every diagnosis")
    cli.add_argument("--summary", type=Path, help="JSON file with a row for each")
    cli.add_argument("--one", nargs="+", help=argparse.SUPPRESS)
    told = cli.parse_args(arguments)
    try:
        if told.one:
            from surgisim.config.base import parse
            from surgisim.config.diagnosis import Diagnosing
            from surgisim.diagnosis.files import carry_out

            settings = parse(Diagnosing, dict(map(_setting, told.one[2:])), "diagnose")
            print(carry_out([Path(told.one[0])], Path(told.one[1]), settings))
            return 0
        if told.list is None:
            cli.error("--list is wanted")
        jobs = jobs_of(told.list.read_text(), ("workers=1", *told.set))
    except (Problem, OSError) as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 2
    rows = []
    gpus = tuple(gpu for gpu in told.gpus.split(",") if gpu)
    for row in carried_out(jobs, side_by_side=told.jobs, limit=told.limit, gpus=gpus):
        rows.append(row)
        print(line(row, len(rows), len(jobs)), flush=True)
    summary = json.dumps(sorted(rows, key=lambda row: row["out"]), indent=1) + "\n"
    if told.summary:
        told.summary.write_text(summary)
    else:
        print(summary)
    return int(any(row["state"] in ("failed", "late") for row in rows))


if __name__ == "__main__":
    sys.exit(main())
