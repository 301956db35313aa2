"""What every stage script shares: flags, checked reading, one call, whole writing, plain errors.

A stage is declared by what it reads and writes:

    @stage(reads={"frames": Frames}, writes={"masks": Masks}, settings=Masking)
    def main(frames, *, settings, progress): ...

The runner turns that into `--frames PATH --masks PATH --settings JSON`, loads and checks the
inputs, calls the function, and writes all of its outputs or none.
"""

import argparse
import errno
import inspect
import json
import os
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from surgisim.artifacts.base import Artifact, encoded, load, save_bytes
from surgisim.config.base import Settings, parse
from surgisim.problem import Problem
from surgisim.side_by_side import openmp

SPINS = "3000"
"""Rounds for which an idle thread waits awake. A reconstruction of 600 iterations on two processors took 24.5 s with
none, 20.5 with 3,000, 18.8 with 20,000; beside another process that kept one of them busy 31, 35 and 61 s."""


@dataclass(frozen=True)
class Maybe:
    """A kind that may be absent: the flag may be left out, and the function gets None."""

    kind: type[Artifact]


@dataclass(frozen=True)
class Several:
    """One or more files of a kind: the function gets a list, of paths where the kind is a Source."""

    kind: "type[Artifact] | Source"


@dataclass(frozen=True)
class Bytes:
    """An output that is no artifact kind: the function returns its bytes."""

    suffix: str


@dataclass(frozen=True)
class Source:
    """An input that is no artifact kind: the function gets its path, and reads it itself."""

    wanted: str
    required: bool = True


class Progress:
    """Says how far a long piece of work is, on standard error, at most every two seconds."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.begun = time.monotonic()
        self.said = 0.0

    def __call__(self, done: float, total: float, text: str = "") -> None:
        now = time.monotonic()
        if now - self.said < 2.0 and done < total:
            return
        self.said = now
        spent = now - self.begun
        left = f", {spent * (total - done) / done:.0f} s left" if 0 < done < total else ""
        print(
            f"{self.name} {100 * done / max(total, 1e-9):3.0f} %  {text}{left} ({spent:.0f} s)",
            file=sys.stderr,
            flush=True,
        )


def stage(
    *, reads: Mapping[str, Any], writes: Mapping[str, Any], settings: type[Settings]
) -> Callable[[Callable[..., Any]], Callable[[], None]]:
    """Turn a function into a stage's command line."""

    def wrap(work: Callable[..., Any]) -> Callable[[], None]:
        script = Path(inspect.getsourcefile(work) or "stage.py")

        def main() -> None:
            doc = inspect.getmodule(work).__doc__ or work.__doc__ or ""
            cli = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
            for name, kind in reads.items():
                needed = kind.required if isinstance(kind, Source) else not isinstance(kind, Maybe)
                count = {"nargs": "+"} if isinstance(kind, Several) else {}
                cli.add_argument(_flag(name), type=Path, required=needed, help=f"read: {_wanted(kind)}", **count)
            for name, kind in writes.items():
                cli.add_argument(_flag(name), type=Path, required=True, help=f"write: {_wanted(kind)}")
            cli.add_argument("--settings", default="{}", help="this stage's slice of the config, as JSON")
            cli.add_argument("--code", default="", help="digest of the code, written into the headers")
            cli.add_argument("--debug", action="store_true", help="show tracebacks")
            arguments = vars(cli.parse_args())
            # Idle threads of torch and of the compiled loops that spin on each other's cores cost several times the
            # work itself; ones that sleep at once wake late. It has to be said before either is loaded.
            os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
            os.environ.setdefault("GOMP_SPINCOUNT", SPINS)
            openmp()
            with plain_errors(arguments["debug"] or bool(os.environ.get("SURGISIM_DEBUG"))):
                _run(work, script.stem, reads, writes, settings, arguments)

        return main

    return wrap


def _run(work, name, reads, writes, kind_of_settings, arguments) -> None:
    try:
        raw = json.loads(arguments["settings"])
    except json.JSONDecodeError as error:
        raise Problem(f"--settings is not JSON ({error}). Pass an object such as '{{}}'.") from error
    chosen = parse(kind_of_settings, raw, name)
    inputs = {key: _read(kind, arguments[key]) for key, kind in reads.items()}
    result = work(**inputs, settings=chosen, progress=Progress(name))
    results = result if isinstance(result, tuple) else (result,)
    files = {}
    for (key, kind), value in zip(writes.items(), results, strict=True):
        if isinstance(kind, Bytes):
            files[arguments[key]] = value
        else:
            files[arguments[key]] = encoded(
                value, producer=name, settings=chosen.model_dump(mode="json"), code=arguments["code"]
            )
    save_bytes(files)


def _read(kind: Any, path: Any) -> Any:
    if isinstance(kind, Source):
        return path
    if isinstance(kind, Several):
        return [_read(kind.kind, each) for each in path]
    if isinstance(kind, Maybe):
        return None if path is None else load(kind.kind, path)
    return load(kind, path)


class plain_errors:
    """Print a Problem, or a full or unreadable disk, as one sentence and leave with a non-zero code."""

    def __init__(self, debug: bool) -> None:
        self.debug = debug

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind, error, _trace) -> bool:
        if error is None or self.debug:
            return False
        if isinstance(error, Problem):
            print(f"error: {error}", file=sys.stderr)
            sys.exit(2)
        if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
            print(f"error: {_place(error)}: the disk is full. Make room and start again.", file=sys.stderr)
            sys.exit(3)
        if isinstance(error, OSError) and error.errno in (errno.EACCES, errno.EROFS, errno.ENOENT):
            print(f"error: {_place(error)}: {os.strerror(error.errno).lower()}.", file=sys.stderr)
            sys.exit(2)
        return False


def _place(error: OSError) -> str:
    return str(error.filename or "output")


def _flag(name: str) -> str:
    return "--" + name.replace("_", "-")


def _wanted(kind: Any) -> str:
    if isinstance(kind, Source):
        return kind.wanted
    if isinstance(kind, Bytes):
        return f"a {kind.suffix} file"
    if isinstance(kind, Maybe | Several):
        return _wanted(kind.kind)
    return f"{kind.__name__} ({kind.SUFFIX}): {(kind.__doc__ or '').strip().splitlines()[0]}"
