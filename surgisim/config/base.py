"""What every group of settings shares."""

import difflib
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from surgisim.problem import Problem

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
            known = _fields(kind, first["loc"][:-1])
            near = difflib.get_close_matches(str(first["loc"][-1]), known, 1, 0.0)
            raise Problem(
                f"{where}: there is no key '{key}'; did you mean '{near[0]}'? Known here: {', '.join(sorted(known))}."
            ) from error
        raise Problem(f"{where}: key '{key}' is {first.get('input')!r}: {first['msg']}.") from error


def _fields(kind: type[BaseModel], path: tuple[Any, ...]) -> list[str]:
    for part in path:
        field = kind.model_fields.get(part)
        if field is None or not (isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel)):
            break
        kind = field.annotation
    return list(kind.model_fields)
