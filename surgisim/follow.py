"""Show a run while it runs: on a terminal in place, elsewhere line by line."""

import contextlib
import time
from collections.abc import Callable, Iterator

from rich.console import Console, Group
from rich.live import Live
from rich.markup import escape
from rich.text import Text

from surgisim.launch import Job, State

EVERY = 15.0
"""Seconds between two lines about the same running job where there is no terminal."""


@contextlib.contextmanager
def follower(console: Console, *, quiet: bool) -> Iterator[Callable[[State], None]]:
    """A function to call with the run's state, often."""
    if quiet:
        yield lambda state: None
    elif console.is_terminal:
        with Live(console=console, refresh_per_second=4, transient=True) as live:
            seen: set[str] = set()

            def show(state: State) -> None:
                _tell_ended(console, state, seen)
                live.update(Group(*(_line(job, state) for job in state.running if job.rule != "all")))

            yield show
    else:
        seen, spoken = set(), {}

        def tell(state: State) -> None:
            _tell_ended(console, state, seen)
            for key, job in state.jobs.items():
                if job.ended is None and job.rule != "all" and time.monotonic() - spoken.get(key, job.begun) > EVERY:
                    spoken[key] = time.monotonic()
                    console.print(_line(job, state))

        yield tell


def _tell_ended(console: Console, state: State, seen: set[str]) -> None:
    for key, job in state.jobs.items():
        if job.ended is not None and key not in seen and job.rule != "all":
            seen.add(key)
            mark = "[red]failed[/]" if job.failed else "done"
            console.print(f"{_count(len(seen), state)} {escape(job.name):32s} {mark} in {job.seconds():.0f} s")


def _line(job: Job, state: State) -> Text:
    return Text(f"{_count(state.done, state)} {job.name:32s} {job.seconds():4.0f} s  {job.latest().strip()[:100]}")


def _count(done: int, state: State) -> str:
    return f"{done:3d}/{max(state.total, done)}"
