"""Every choice of a run in one place: one group of settings per stage.

A stage's group is the file of its name beside this one. `python -m surgisim.config.whole FOLDER`
writes config.yaml and schemas/ from the models, so that neither can say something else.
"""

import importlib
import json
import sys
from pathlib import Path
from types import MappingProxyType
from typing import Any, get_args

import yaml
from pydantic import BaseModel, Field, create_model

from surgisim.config.base import Settings
from surgisim.config.containers import Containers

PARENTS = MappingProxyType(
    {
        "phantom": (),
        "ingest": ("phantom",),
        "masking": ("ingest",),
        "inpainting": ("masking",),
        "correspondence": ("masking",),
        "depth": ("inpainting", "correspondence"),
        "tracking": ("depth",),
        "reconstruction": ("depth",),
        "thickening": ("reconstruction",),
        "estimation": ("thickening", "tracking"),
        "simulation": ("estimation",),
        "evaluation": ("simulation",),
        "report": ("evaluation",),
    }
)
"""The stages in order, each with those whose settings reach it (through their own parents too)."""

ON_REQUEST = MappingProxyType({"diagnosis": "Diagnosing"})
"""Stages that run only where they are asked for, each with the name of its settings model."""


class Choices(Settings):
    """What is run, and how."""

    run: tuple[str, ...] = ("main",)
    """Variants to run, names in variants.yaml [list of names]."""
    weights: Path | None = None
    """Folder of networks' weights, each found by its name (`surgisim doctor` lists them) [path]."""
    containers: Containers = Field(default_factory=Containers)


def group(stage: str) -> type[Settings]:
    """The settings model of one stage."""
    return getattr(importlib.import_module(f"surgisim.config.{stage}"), ON_REQUEST.get(stage, stage.capitalize()))


def _whole() -> type[Choices]:
    groups = [s for s in (*PARENTS, *ON_REQUEST) if Path(__file__).with_name(f"{s}.py").is_file()]
    fields: dict[str, Any] = {s: (group(s), Field(default_factory=group(s))) for s in groups}
    return create_model("Whole", __base__=Choices, __doc__="Every choice of a run.", **fields)


Whole = _whole()


def rooted(raw: dict[str, Any], folder: Path, kind: type[BaseModel] | None = None) -> dict[str, Any]:
    """`raw` with relative paths made absolute from `folder`, for stages run in another one."""
    fields = (kind or Whole).model_fields
    result = dict(raw)
    for key, content in raw.items():
        field = fields.get(key)
        wanted = field.annotation if field else None
        if isinstance(content, dict) and isinstance(wanted, type) and issubclass(wanted, BaseModel):
            result[key] = rooted(content, folder, wanted)
        elif field and content and isinstance(content, str | Path) and is_path(field) and "://" not in str(content):
            result[key] = str((folder / content).absolute())
    return result


def is_path(field: Any) -> bool:
    """Whether a setting names a file or a folder."""
    return Path in (field.annotation, *get_args(field.annotation)) or (field.description or "").endswith("[path]")


def defaults() -> str:
    """config.yaml: every key at its default, with what it means above it."""
    head = (
        "# Every choice of the method, at its default. Written by `make config` from surgisim/config/;\n"
        "# `make test` fails if the two differ. Change values in a file of your own and pass it:\n"
        "#   surgisim run clip.mp4 --config mine.yaml      (only the keys that differ need to be there)\n"
    )
    return head + "".join(_lines(Whole(), ""))


def _lines(values: BaseModel, indent: str):
    for name, field in type(values).model_fields.items():
        value = getattr(values, name)
        nested = isinstance(value, BaseModel)
        text = field.description or (type(value).__doc__ if nested else "") or ""
        if not indent:
            yield "\n"
        if nested and not field.description:
            text = text.strip().split("\n\n")[0]
        for line in _wrapped(text, 110 - len(indent)):
            yield f"{indent}# {line}\n"
        if nested and type(value).model_fields:
            yield f"{indent}{name}:\n"
            yield from _lines(value, indent + "  ")
        else:
            plain = value.model_dump(mode="json") if nested else values.model_dump(mode="json", include={name})[name]
            written = yaml.safe_dump(plain, default_flow_style=True, width=10000).removesuffix("\n...\n").strip()
            yield f"{indent}{name}: {written}\n"


def _wrapped(text: str, width: int):
    line = ""
    for word in text.split():
        if line and len(line) + 1 + len(word) > width:
            yield line
            line = ""
        line = f"{line} {word}".strip()
    if line:
        yield line


def schemas() -> dict[str, dict[str, Any]]:
    """JSON schemas by file name, for editors and for anything that makes configs."""
    whole = Whole.model_json_schema()
    inner = {k: v for k, v in whole.items() if k != "$defs"}
    variants = {
        "$defs": whole.get("$defs", {}) | {"Whole": inner},
        "title": "Variants",
        "description": "Variant name -> the keys of config.yaml that it changes.",
        "type": "object",
        "propertyNames": {"pattern": NAME},
        "additionalProperties": {"$ref": "#/$defs/Whole"},
    }
    return {"config.schema.json": whole, "variants.schema.json": variants}


NAME = r"^[A-Za-z0-9][A-Za-z0-9_-]*$"
"""What clips and variants may be called: they become folders."""


def files() -> dict[str, str]:
    """Every generated file of config/, path -> content."""
    texts = {f"schemas/{name}": json.dumps(body, indent=1) + "\n" for name, body in schemas().items()}
    return {"config.yaml": defaults()} | texts


if __name__ == "__main__":
    for name, content in files().items():
        path = Path(sys.argv[1]) / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)
