"""The table of clips: one row a clip, a column for each setting that differs between them."""

import csv
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from surgisim.config.whole import NAME
from surgisim.problem import Problem

EMBEDDED = "phantom"
"""A path of this name means the clip that the project invents."""

SHORT = {"focal": "ingest.focal", "grasp": "tracking.grasp", "clicks": "masking.clicks"}
"""Columns and flags with a name of their own; any other is called 'stage.key'."""


@dataclass(frozen=True)
class Clip:
    name: str
    path: Path | None
    """None for the embedded clip."""
    overrides: dict[str, Any]
    """The keys of config.yaml that this clip changes, nested."""


def invented(changes: dict[str, dict[str, Any]]) -> dict[str, Clip]:
    """Embedded clips by their names, each with the keys of config.yaml that it changes."""
    return {name: Clip(name, None, overrides) for name, overrides in changes.items()}


def read_clips(table: Path) -> dict[str, Clip]:
    """Every row by its name. Paths in the table are relative to the table's folder."""
    if not table.is_file():
        raise Problem(f"{table}: no such file, but the table of clips is wanted here (columns: name, path).")
    lines = [line for line in table.read_text().splitlines() if line.strip() and not line.startswith("#")]
    rows = list(csv.DictReader(lines, delimiter="\t"))
    columns = list(rows[0]) if rows else []
    if not rows or "name" not in columns or "path" not in columns:
        raise Problem(
            f"{table}: found columns {columns} and {len(rows)} rows; at least one row under 'name' and 'path' is "
            "wanted, separated by tabs."
        )
    clips: dict[str, Clip] = {}
    for row in rows:
        clip = _clip(row, table)
        if clip.name in clips:
            raise Problem(f"{table}: two rows are named '{clip.name}'. Give each clip a name of its own.")
        clips[clip.name] = clip
    return clips


def _clip(row: dict[str, Any], table: Path) -> Clip:
    if None in row or None in row.values():
        raise Problem(f"{table}: the row of '{row['name']}' has more or fewer cells than the header. Separate by tabs.")
    name, path = row["name"].strip(), row["path"].strip()
    if not re.match(NAME, name):
        raise Problem(
            f"{table}: a clip is named '{name}'; letters, digits, '_' and '-' are wanted, as it names a folder."
        )
    overrides: dict[str, Any] = {}
    for column, cell in row.items():
        if column in ("name", "path") or not cell.strip():
            continue
        merge_entry(overrides, column, cell, table.parent, f"{table}: clip '{name}'")
    return Clip(name, None if path == EMBEDDED else (table.parent / path).resolve(), overrides)


def merge_entry(tree: dict[str, Any], key: str, text: str, folder: Path, where: str) -> None:
    """Write what a cell or a flag says into the nested settings; `key` is in SHORT or 'stage.key'."""
    content = value(text, folder)
    put(tree, SHORT.get(key, key), _grip(content, where) if key == "grasp" else content)


def _grip(content: Any, where: str) -> list[dict[str, Any]]:
    """'X,Y,RADIUS' with an optional START and END as the settings of one grip; a list of such settings as it is."""
    if isinstance(content, list) and content and all(isinstance(entry, dict) for entry in content):
        return content
    if not isinstance(content, list) or not 3 <= len(content) <= 5:
        raise Problem(
            f"{where}: grasp is {content!r}; X,Y,RADIUS is wanted, in pixels of the recording's first frame, and "
            "after them START,END [s] if you know them."
        )
    x, y, radius, *times = content
    return [{"pixel": [x, y], "radius": radius} | dict(zip(("start", "end"), times, strict=False))]


def put(tree: dict[str, Any], key: str, content: Any) -> None:
    """Write `content` at 'a.b.c' into the nested dictionary."""
    *groups, last = key.split(".")
    for part in groups:
        tree = tree.setdefault(part, {})
    tree[last] = content


def value(text: str, folder: Path) -> Any:
    """A cell or a command-line value as YAML reads it; '31,20' is a list, '@clicks.json' what that file holds."""
    text = text.strip()
    try:
        if text.startswith("@"):
            return yaml.safe_load((folder / text[1:]).read_text())
        return yaml.safe_load(f"[{text}]" if "," in text and text[0] not in "[{\"'" else text)
    except FileNotFoundError:
        raise Problem(f"{folder / text[1:]}: no such file, but '{text}' asks for its content.") from None
    except yaml.YAMLError as error:
        raise Problem(f"'{text}' is not YAML ({' '.join(str(error).split())}).") from error
