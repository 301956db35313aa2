"""How a page was made: when, from which code and settings, with which versions, on which machine."""

import importlib.metadata
import json
import os
import platform
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from surgisim.machine import graphics, memory, processor

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("surgisim", "torch", "warp-lang", "numpy", "numba", "gsplat", "snakemake")


@dataclass(frozen=True)
class Made:
    date: str
    """When the page was written, UTC."""
    commit: str
    """Git commit of the checkout, "with changes" where tracked files differ from it."""
    versions: str
    machine: str
    settings: dict[str, str]
    """Stage -> its settings as JSON."""
    code: dict[str, str]
    """Stage -> digest of all code that it imports."""


def made(settings: Mapping[str, Any] | None = None, code: Mapping[str, str] | None = None) -> Made:
    """As this process finds it; settings: stage -> object, code: stage -> digest.

    SOURCE_DATE_EPOCH [s], where it is set, is the date, so that the same page can be made twice
    (reproducible-builds.org/specs/source-date-epoch).
    """
    told = os.environ.get("SOURCE_DATE_EPOCH")
    now = datetime.fromtimestamp(int(told), UTC) if told else datetime.now(UTC)
    return Made(
        date=f"{now:%Y-%m-%d %H:%M} UTC",
        commit=commit(ROOT),
        versions=versions(),
        machine=machine(),
        settings={stage: json.dumps(group, indent=1, sort_keys=True) for stage, group in (settings or {}).items()},
        code=dict(code or {}),
    )


def commit(root: Path) -> str:
    """Commit of the checkout at `root`; what lies in no checkout of its own has none."""

    def git(*words: str) -> str:
        # Folders of another user are asked too: inside of an image nearly all are.
        command = ["git", "-c", f"safe.directory={root}", "-C", str(root), *words]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()

    try:
        if Path(git("rev-parse", "--show-toplevel")).resolve() != root.resolve():
            return "not known: the code lies in no checkout of its own"
        changed = git("status", "--porcelain", "--untracked-files=no")
        return git("rev-parse", "HEAD")[:12] + (" with changes" if changed else "")
    except (OSError, subprocess.CalledProcessError):
        return "not known: git does not answer here"


def versions() -> str:
    """Of Python and those of PACKAGES that are installed."""
    found = [f"Python {platform.python_version()}"]
    for name in PACKAGES:
        try:
            found.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            continue
    return ", ".join(found)


def machine() -> str:
    cores = len(os.sched_getaffinity(0))
    cards = ", ".join(graphics()) or "no GPU"
    return f"{processor()}, {cores} core{'s' if cores != 1 else ''}, {memory()[0]:.0f} GiB memory, {cards}"
