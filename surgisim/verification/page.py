"""Run a case, keep what it measured, and put every kept result on one page."""

import importlib
import json
import math
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from surgisim.verification.cases import absence, cases

Progress = Callable[[float, float, str], None]
DIGITS = 6
"""Significant digits that are kept of a figure."""

INTRODUCTION = """# Verification

The engine compared with closed forms, with other people's solutions and with recordings. Every section is one file
in `surgisim/verification/`; `snakemake verification` (or `python -m surgisim.verification`) measures them again and
writes this page. Numbers behind every table: `docs/verification/NAME.json`.
"""


def run(name: str, out: Path, *, quick: bool = False, progress: Progress = lambda done, total, text: None) -> float:
    """Measure one case and write NAME.json and NAME.png into `out`; the processor time it took [s]."""
    module = importlib.import_module(f"surgisim.verification.{name}")
    begun = time.process_time()
    result = rounded(module.measure(progress, quick=quick))
    seconds = time.process_time() - begun
    out.mkdir(parents=True, exist_ok=True)
    # Drawn before anything is written: a picture that fails leaves the old pair as it was.
    draw(name, result, out)
    kept = {"case": name, "title": module.TITLE, "quick": quick, "seconds": round(seconds, 1), "result": result}
    _replace(out / f"{name}.json", json.dumps(kept, indent=1) + "\n")
    return seconds


def draw(name: str, result: dict, out: Path) -> None:
    """Write NAME.png."""
    figure = importlib.import_module(f"surgisim.verification.{name}").draw(result)
    figure.savefig(out / f".{name}.png", dpi=110, metadata={"Software": None})
    os.replace(out / f".{name}.png", out / f"{name}.png")


def assemble(out: Path, page: Path) -> list[str]:
    """Write `page` from the results in `out`; the names it holds.

    What has no result is named with the reason, and what was measured in the small version says so.
    """
    parts, shown = [INTRODUCTION], []
    for name, case in cases().items():
        parts.append(f"## {case.title}\n")
        if not (out / f"{name}.json").is_file():
            parts.append(f"Not measured: {absence(case) or f'{name}.json is not there.'}\n")
            continue
        kept = json.loads((out / f"{name}.json").read_text())
        module = importlib.import_module(f"surgisim.verification.{name}")
        if kept["quick"]:
            parts.append("*The small version that tests run, not the full one.*\n")
        parts.append(module.words(kept["result"]).strip() + "\n")
        parts.append(f"![{case.title}]({os.path.relpath(out / f'{name}.png', page.parent)})\n")
        parts.append(f"`surgisim/verification/{name}.py`, {kept['seconds']:.0f} s of processor time.\n")
        shown.append(name)
    _replace(page, "\n".join(parts))
    return shown


def rounded(value: Any) -> Any:
    """The same, JSON-able, with floats at six significant digits."""
    if isinstance(value, dict):
        return {str(k): rounded(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(v) for v in value]
    if hasattr(value, "tolist"):
        return rounded(value.tolist())
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None
    return value


def _replace(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}")
    temporary.write_text(text)
    os.replace(temporary, path)
