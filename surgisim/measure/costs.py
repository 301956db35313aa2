"""Wall time and peak memory of every stage, from the workflow's benchmark files."""

import csv
import math
import os
from pathlib import Path

from surgisim.problem import Problem


def costs(place: Path) -> dict[str, dict[str, float]]:
    """Stage -> {"seconds", "peak_mb"}; a number that was not measured is left out.

    `place` is a folder of `{stage}.tsv`, or such files joined by the path separator.
    Snakemake's columns `s` and `max_rss` [MB] are read, the first row of each.
    """
    files = sorted(place.glob("*.tsv")) if place.is_dir() else [Path(part) for part in str(place).split(os.pathsep)]
    found = {}
    for file in files:
        if not file.is_file():
            raise Problem(f"{file}: no such benchmark file. Pass a folder of STAGE.tsv, or leave --benchmarks out.")
        row = next(csv.DictReader(file.read_text().splitlines(), delimiter="\t"), None)
        if row is None or "s" not in row:
            raise Problem(f"{file}: is no benchmark file: a table with a column 's' is wanted.")
        numbers = {"seconds": row["s"], "peak_mb": row.get("max_rss", "-")}
        found[file.stem] = {name: value for name, text in numbers.items() if math.isfinite(value := _number(text))}
    return found


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:  # Snakemake writes '-' or 'NA' for a job too short to be measured
        return math.nan
