"""Start the graph, follow it, and say in one sentence what went wrong."""

import contextlib
import fcntl
import json
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from surgisim.problem import Problem


@dataclass
class Job:
    rule: str
    wildcards: dict[str, str]
    log: Path
    begun: float
    ended: float | None = None
    failed: bool = False

    @property
    def name(self) -> str:
        return " ".join([self.rule, "/".join(self.wildcards.values())]).strip()

    def seconds(self) -> float:
        return (self.ended or time.monotonic()) - self.begun

    def latest(self) -> str:
        """The last line of its log that says how far it is."""
        return next((line for line in reversed(tail(self.log)) if line.startswith(f"{self.rule} ")), "")


@dataclass
class State:
    """What is known of the run so far."""

    total: int = 0
    done: int = 0
    jobs: dict[str, Job] = field(default_factory=dict)
    complaints: list[str] = field(default_factory=list)
    """What Snakemake itself objected to."""
    said: list[str] = field(default_factory=list)
    """The last lines it wrote outside its events."""

    @property
    def running(self) -> list[Job]:
        return [job for job in self.jobs.values() if job.ended is None]

    @property
    def failed(self) -> list[Job]:
        return [job for job in self.jobs.values() if job.failed]


def home() -> Path:
    """The checkout that holds the workflow."""
    place = Path(os.environ.get("SURGISIM_HOME") or Path(__file__).parents[1]).resolve()
    if not (place / "workflow" / "Snakefile").is_file():
        raise Problem(
            f"{place}: holds no workflow/Snakefile, and the graph lives in the checkout, not in the installed package. "
            "Install from a checkout (pip install -e .), or set SURGISIM_HOME to one."
        )
    return place


@contextlib.contextmanager
def alone(out: Path) -> Iterator[int]:
    """One run at a time in a folder; the lock falls with the last process that holds it."""
    (out / ".snakemake").mkdir(parents=True, exist_ok=True)
    with open(out / ".snakemake" / "surgisim.lock", "w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise Problem(f"{out}: another run is at work here. Wait for it, or choose another --out.") from None
        yield lock.fileno()


def launch(out: Path, arguments: Sequence[str], *, show: Any, debug: bool) -> tuple[int, State]:
    """Run Snakemake in `out`; `show(state)` is called about four times a second."""
    place = home()
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(place / "workflow" / "Snakefile")]
    command += ["--directory", str(out), "--rerun-incomplete", "--nolock", "--logger", "surgisim", *arguments]
    paths = [str(place / "workflow" / "logger"), os.environ.get("PYTHONPATH", "")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))}
    if debug:
        environment["SURGISIM_DEBUG"] = "1"
    state = State()
    with alone(out) as lock, _obeying_signals():
        child = subprocess.Popen(
            command,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=None if debug else subprocess.PIPE,
            pass_fds=(lock,),
            start_new_session=True,
        )
        try:
            _follow(child, state, out, show, debug)
        except KeyboardInterrupt:
            _stop(child)
            raise
    return child.returncode, state


def _follow(child: subprocess.Popen, state: State, out: Path, show: Any, debug: bool) -> None:
    streams = {s: b"" for s in (child.stdout, child.stderr) if s}
    for stream in streams:
        os.set_blocking(stream.fileno(), False)
    shown = 0.0
    while True:
        over = child.poll() is not None
        for stream in streams:
            *lines, streams[stream] = (streams[stream] + (stream.read() or b"")).split(b"\n")
            for line in lines:
                _hear(line.decode(errors="replace"), state, out, debug)
        if over or time.monotonic() - shown > 0.25:
            show(state)
            shown = time.monotonic()
        if over:
            return
        # Not a plain sleep: a large plan fills the pipe many times over, and Snakemake would wait for each emptying.
        select.select(list(streams), [], [], 0.25)


def _hear(line: str, state: State, out: Path, debug: bool) -> None:
    if debug:
        print(line, file=sys.stderr)
    if not line.startswith('{"event"'):
        state.said = [*state.said[-20:], line]
        return
    said = json.loads(line)
    event = said["event"]
    key = str(said.get("jobid", said.get("job_id")))
    if event == "run_info":
        stats = said["stats"]
        state.total = max(state.total, stats.get("total", 0) - stats.get("all", 0))
    elif event == "job_info":
        log = out / said["log"][0] if said["log"] else Path(os.devnull)
        state.jobs[key] = Job(said["rule_name"], said["wildcards"] or {}, log, time.monotonic())
    elif event == "job_finished" and key in state.jobs:
        state.jobs[key].ended = time.monotonic()
    elif event == "job_error" and key in state.jobs:
        state.jobs[key].ended = time.monotonic()
        state.jobs[key].failed = True
    elif event == "progress":
        state.done = said["done"]
    elif said["level"] in ("ERROR", "CRITICAL"):
        state.complaints.append(said["text"])


def why(job: Job, said: Sequence[str] = ()) -> str:
    """One sentence on why a job failed, from its log, and from what the shell said of its end."""
    lines = [line for line in tail(job.log, 20000) if line.strip()]
    for line in reversed(lines):
        if line.startswith("error: "):
            return line.removeprefix("error: ")
    if any(line.startswith("Traceback") for line in lines):
        return f"{lines[-1]} (a fault of the program, not of the input; {job.log} has the details)"
    if any("Segmentation fault" in line for line in said):
        return f"crashed (a fault of the program, not of the input; {job.log} has what it said before)"
    return f"stopped without a word; was it killed, for want of memory perhaps? ({job.log} has what it said before)"


def tail(path: Path, size: int = 2000) -> list[str]:
    """The last lines of a text file, those of a progress bar on one line apart; none if it is not there."""
    try:
        with open(path, "rb") as stream:
            stream.seek(0, os.SEEK_END)
            stream.seek(max(0, stream.tell() - size))
            return stream.read().decode(errors="replace").replace("\r", "\n").split("\n")
    except FileNotFoundError:
        return []


@contextlib.contextmanager
def _obeying_signals() -> Iterator[None]:
    """A request to end, or a closed terminal, stops as cleanly as Ctrl-C."""

    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    # SIGINT too: a shell starts background commands with it ignored, and the child would inherit that.
    before = {s: signal.signal(s, interrupt) for s in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _stop(child: subprocess.Popen) -> None:
    """Ask Snakemake and its jobs to stop; after 20 s, or when asked again, make them."""
    with contextlib.suppress(ProcessLookupError, KeyboardInterrupt, subprocess.TimeoutExpired):
        os.killpg(child.pid, signal.SIGINT)
        child.communicate(timeout=20)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child.pid, signal.SIGKILL)
    child.wait()
