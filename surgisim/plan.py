"""What is to be run: clips times variants, the settings of each, and what they share."""

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from surgisim.clips import Clip, read_clips
from surgisim.config.base import parse
from surgisim.config.whole import NAME, ON_REQUEST, PARENTS, Choices, Whole, rooted
from surgisim.problem import Problem
from surgisim.weights import filled, found

OWN = ("evaluation", "report")
"""Stages about one clip and one variant: never shared, even where the settings agree."""


@dataclass(frozen=True)
class Plan:
    clips: dict[str, Clip]
    run: tuple[str, ...]
    """Variants to run."""
    variants: tuple[str, ...]
    """Variants that could be run, the main one first."""
    slices: dict[tuple[str, str, str], str]
    """(stage, clip, variant) -> the stage's own settings and nothing else, as JSON; also of stages on request."""
    homes: dict[tuple[str, str, str], str]
    """(stage, clip, variant) -> the first variant whose settings agree this far: the stage's output lies there."""
    choices: Choices
    """The config itself, for work on what is no clip."""


def table_of(config: Mapping[str, Any], key: str, default: Path) -> Path:
    """The file of clips or of variants that a config names, `default` if it names none. Raises Problem for no path."""
    told = config.get(key, default)
    if not isinstance(told, str | Path):
        raise Problem(
            f"config: key '{key}' is {told!r}, and the path of a file is wanted, such as {default.name} of this "
            "program's config folder. Write the rows there, and its path here."
        )
    return Path(told)


def plan(config: Mapping[str, Any], *, clips: Path | Mapping[str, Clip], variants: Path) -> Plan:
    """Merge and check everything. What a variant changes wins over the clip, the clip over config.

    clips: their table, or the clips themselves.
    """
    choices = parse(Whole, dict(config), "config")
    run = choices.run
    table = clips if isinstance(clips, Path) else Path()
    rows = read_clips(clips) if isinstance(clips, Path) else dict(clips)
    overrides = read_variants(variants)
    unknown = [v for v in run if v not in overrides]
    if unknown:
        raise Problem(
            f"config: key 'run' names {unknown}, and {variants} holds {list(overrides)}. Correct one of them."
        )
    # A mistake is blamed on the file that holds it: each variant is tried on its own first.
    for variant, changes in overrides.items():
        parse(Whole, merged(config, changes), f"{variants}: variant '{variant}'")
    slices, homes, known = {}, {}, {}
    there = found(choices.weights) if choices.weights else {}
    for name, clip in rows.items():
        own = merged(config, rooted(clip.overrides, table.resolve().parent))
        first: dict[tuple[str, str], str] = {}
        for variant, changes in overrides.items():
            raw = filled(merged(own, changes), there)
            key = json.dumps(raw, sort_keys=True, default=str)
            if key not in known:
                known[key] = _slices(parse(Whole, raw, f"{table}: clip '{name}'"))
            reach: dict[str, str] = {}
            for stage, shared in known[key].items():
                mine = shared if stage not in OWN else _named(shared, clip=name, variant=variant)
                slices[stage, name, variant] = mine
                if stage in ON_REQUEST:
                    continue
                reach[stage] = _digest(mine, *(reach[p] for p in PARENTS[stage] if p in reach))
                homes[stage, name, variant] = (
                    variant if stage in OWN else first.setdefault((stage, reach[stage]), variant)
                )
    return Plan(rows, run, tuple(overrides), slices, homes, choices)


def _slices(settings: Choices) -> dict[str, str]:
    whole = settings.model_dump(mode="json")
    return {stage: json.dumps(whole.get(stage, {}), sort_keys=True) for stage in (*PARENTS, *ON_REQUEST)}


def _named(settings: str, **names: str) -> str:
    """The settings with the clip's and the variant's names in, where the stage has keys for them."""
    whole = json.loads(settings)
    return json.dumps(whole | {key: name for key, name in names.items() if key in whole}, sort_keys=True)


def _digest(*texts: str) -> str:
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()


def read_variants(path: Path) -> dict[str, dict[str, Any]]:
    """Variant -> what it changes; the main variant, which changes nothing, comes first."""
    if not path.is_file():
        raise Problem(f"{path}: no such file, but the variants are wanted here. 'main: {{}}' is the least it may hold.")
    try:
        raw = yaml.safe_load(path.read_text()) or {}
    except yaml.YAMLError as error:
        raise Problem(f"{path}: is not YAML ({' '.join(str(error).split())}).") from error
    wrong = [k for k, v in raw.items() if not re.match(NAME, str(k)) or not isinstance(v or {}, dict)]
    if wrong or raw.get("main", 0):
        raise Problem(
            f"{path}: {wrong or ['main']} does not fit; a name of letters, digits, '_' and '-' is wanted, then the "
            "keys it changes; 'main' changes nothing."
        )
    return {"main": {}} | {name: changes or {} for name, changes in raw.items()}


def merged(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """`base` with `changes` laid over it, group by group; lists are replaced whole."""
    result = dict(base)
    for key, new in changes.items():
        old = result.get(key)
        result[key] = merged(old, new) if isinstance(old, Mapping) and isinstance(new, Mapping) else new
    return result
