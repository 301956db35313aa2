"""How an artifact is written whole or not at all, and read only if it is what it says.

Every artifact carries a header: its kind, the units of its arrays, which stage made it,
with which settings and which code. Nothing in it depends on the clock or the machine, so
the same work writes the same bytes.
"""

import contextlib
import dataclasses
import io
import json
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Self, TypeVar

import numpy as np

from surgisim.artifacts.announced import UNREADABLE, check_announced
from surgisim.artifacts.partial import clear_left, partial
from surgisim.problem import Problem

HEADER = "__header__"
QUICKLY = 1
"""How hard arrays are packed, of 9: measured numbers pack as badly at numpy's 6, which takes nearly twice as long."""
A = TypeVar("A", bound="Artifact")


class Artifact:
    """Base of every kind. A kind is a frozen dataclass with `UNITS` and its own checks."""

    SUFFIX: ClassVar[str] = ".npz"
    UNITS: ClassVar[Mapping[str, str]] = {}

    def encode(self, header: dict[str, Any]) -> bytes:
        """The file's bytes: one member per field, and the header."""
        arrays = {HEADER: np.array(json.dumps(header, sort_keys=True))}
        arrays |= {f.name: np.asarray(getattr(self, f.name)) for f in dataclasses.fields(self)}
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=QUICKLY) as archive:
            for name, array in arrays.items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                    np.lib.format.write_array(member, array, allow_pickle=False)
        return stream.getvalue()

    @classmethod
    def decode(cls, path: Path) -> tuple[Self, dict[str, Any]]:
        """Read the file back, never unpickling anything."""
        try:
            with np.load(path, allow_pickle=False) as archive:
                check_announced(archive.zip)
                if HEADER not in archive:
                    raise Problem(
                        f"{path}: has no header, but a {cls.__name__} written by this project is wanted here. "
                        "Pass a file that a stage wrote."
                    )
                header = json.loads(str(archive[HEADER]))
                _check_kind(cls, header, path)
                names = [f.name for f in dataclasses.fields(cls) if f.name in archive or _needed(f)]
                missing = [n for n in names if n not in archive]
                if missing:
                    raise Problem(f"{path}: lacks {missing} of a {cls.__name__}. Run the stage that makes it again.")
                fields = {n: _plain(archive[n]) for n in names}
        except UNREADABLE as error:
            if isinstance(error, Problem | FileNotFoundError):
                raise
            raise Problem(
                f"{path}: cannot be read as a {cls.__name__} ({error}). Delete it and run its stage again."
            ) from error
        return cls(**fields), header


class JsonArtifact(Artifact):
    """A kind kept as readable JSON; its fields are plain numbers, strings, lists and dictionaries."""

    SUFFIX = ".json"

    def encode(self, header: dict[str, Any]) -> bytes:
        body = {"header": header} | dataclasses.asdict(self)
        return (json.dumps(body, indent=1, allow_nan=False) + "\n").encode()

    @classmethod
    def decode(cls, path: Path) -> tuple[Self, dict[str, Any]]:
        try:
            body = json.loads(path.read_text())
        except (json.JSONDecodeError, UnicodeDecodeError) as error:
            raise Problem(f"{path}: is not JSON ({error}), but a {cls.__name__} is wanted here.") from error
        header = body.pop("header", None) if isinstance(body, dict) else None
        if header is None:
            raise Problem(f"{path}: has no header, but a {cls.__name__} written by this project is wanted here.")
        _check_kind(cls, header, path)
        names = {f.name for f in dataclasses.fields(cls)}
        needed = {f.name for f in dataclasses.fields(cls) if _needed(f)}
        if not needed <= set(body) <= names:
            wrong = sorted((needed - set(body)) | (set(body) - names))
            raise Problem(f"{path}: a {cls.__name__} has exactly {sorted(names)}; {wrong} do not match.")
        return cls(**body), header


def save(artifact: Artifact, path: Path, *, producer: str, settings: Mapping[str, Any], code: str) -> None:
    """Write one artifact, whole or not at all."""
    save_bytes({path: encoded(artifact, producer=producer, settings=settings, code=code)})


def encoded(artifact: Artifact, *, producer: str, settings: Mapping[str, Any], code: str) -> bytes:
    """The bytes `save` writes."""
    return artifact.encode(
        {
            "kind": type(artifact).__name__,
            "units": dict(artifact.UNITS),
            "producer": producer,
            "settings": dict(settings),
            "code": code,
        }
    )


def load(kind: type[A], path: Path) -> A:
    """The artifact at `path`, refused in one sentence if it is of another kind or shape."""
    if not path.is_file():
        raise Problem(f"{path}: no such file, but a {kind.__name__} is wanted here. Run the stage that makes it first.")
    try:
        return kind.decode(path)[0]
    except (TypeError, ValueError) as error:
        if isinstance(error, Problem):
            raise
        raise Problem(f"{path}: {error}") from error


def save_bytes(files: Mapping[Path, bytes]) -> None:
    """Write several files under temporary names, flush them to the disk, then rename them all.

    If anything fails before the renames (a full disk, say), no file of the set appears. Others may write the same
    files at the same time: each writes its own, and the last one stays.
    """
    waiting: dict[Path, Path] = {}
    with contextlib.ExitStack() as writing:
        for path, content in files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            clear_left(path)
            try:
                stream = writing.enter_context(partial(path))
                waiting[Path(stream.name)] = path
                stream.write(content)
                stream.flush()
                os.fsync(stream.fileno())
            except OSError as error:
                error.filename = str(path)
                raise
        for temporary, path in waiting.items():
            os.replace(temporary, path)


def _check_kind(kind: type, header: Mapping[str, Any], path: Path) -> None:
    if header.get("kind") != kind.__name__:
        raise Problem(
            f"{path}: holds a {header.get('kind')}, but a {kind.__name__} is wanted here. "
            "Check which stage's output is passed."
        )


def _needed(field: dataclasses.Field) -> bool:
    """Whether a kind is nothing without it."""
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


def _plain(array: np.ndarray) -> Any:
    """Strings and plain scalars come back as themselves, arrays as arrays."""
    return array.item() if array.ndim == 0 else array


def check(condition: bool, message: str) -> None:
    """Used by the kinds' own `__post_init__`."""
    if not condition:
        raise Problem(message)
