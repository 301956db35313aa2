"""What every group of settings shares."""

from collections.abc import Iterator
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from surgisim.problem import Problem, nearest

S = TypeVar("S", bound="Settings")


class Settings(BaseModel):
    """A frozen group of settings; a key it does not have is refused, and the nearest one named."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)


def parse(kind: type[S], raw: dict[str, Any], where: str) -> S:
    """`raw` as settings, or one sentence naming the key, what was found and what is wanted."""
    try:
        return kind.model_validate(raw)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        if first["type"] == "extra_forbidden":
            known, last = _fields(kind, first["loc"][:-1]), str(first["loc"][-1])
            # One that only lacks the name of its group is a key of several, perhaps.
            inside = [k for k in _paths(kind) if k.endswith(f".{last}")] if len(first["loc"]) == 1 else []
            near = "' or '".join(inside) or nearest(last, known)
            raise Problem(
                f"{where}: there is no key '{key}'; did you mean '{near}'? Known here: {', '.join(sorted(known))}."
            ) from error
        words = first["msg"].removeprefix("Value error, ")
        raise Problem(f"{where}: key '{key}' is {first.get('input')!r}: {words}.") from error


def _fields(kind: type[BaseModel], path: tuple[Any, ...]) -> list[str]:
    """Keys that would have been right at `path`, through lists and tagged unions."""
    here = [kind]
    for part in path:
        if isinstance(part, int):
            continue
        tagged = [k for k in here if any(part in get_args(f.annotation) for f in k.model_fields.values())]
        here = tagged or [m for k in here if part in k.model_fields for m in _models(k.model_fields[part].annotation)]
    return [name for k in here for name in k.model_fields]


def _paths(kind: type[BaseModel], before: str = "") -> Iterator[str]:
    """Every key of groups within groups, as 'group.key'."""
    for name, field in kind.model_fields.items():
        yield before + name
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            yield from _paths(field.annotation, f"{before}{name}.")


def _models(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [m for inner in get_args(annotation) for m in _models(inner)]
