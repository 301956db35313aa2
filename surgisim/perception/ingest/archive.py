"""A folder, a zip, or a folder of zips, seen as one tree of named files that is read but never unpacked."""

import re
import stat
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from surgisim.problem import Problem

LARGEST_MEMBER = 512 * 1024**2
"""Largest single file read out of an archive [bytes]."""
LARGEST_RATIO = 2000
"""Deflate's own limit is 1032; a member claiming more is no honest file."""
MOST_MEMBERS = 200_000


@dataclass(frozen=True)
class Tree:
    """Files by their path inside `where`, with forward slashes."""

    where: Path
    files: dict[str, Callable[[], bytes]]

    def read(self, name: str) -> bytes:
        return self.files[name]()

    def inside(self, folder: str) -> list[str]:
        """Names directly in `folder`, in natural order (frame 2 before frame 10)."""
        depth = f"{folder}/" if folder else ""
        return sorted((n for n in self.files if n.startswith(depth) and "/" not in n[len(depth) :]), key=natural)

    def folders(self) -> list[str]:
        """Every folder that holds a file, shallow ones first."""
        found = {str(PurePosixPath(n).parent) for n in self.files}
        return sorted(("" if f == "." else f for f in found), key=lambda f: (f.count("/"), f))


def natural(name: str) -> list[tuple[int, str]]:
    """A sorting key under which numbers inside names count as numbers."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", name)]


def is_film(path: Path) -> bool:
    """Whether a recording is one file of film, and no tree of files."""
    return path.is_file() and path.suffix.lower() != ".zip"


def tree(path: Path, *, max_unpacked: int) -> Tree:
    """The files of a folder (zips in it opened) or of one zip; hidden files are passed over."""
    if path.is_file():
        return Tree(path, _members(path, max_unpacked))
    files: dict[str, Callable[[], bytes]] = {}
    for entry in sorted(path.rglob("*"), key=lambda p: natural(p.as_posix())):
        name = entry.relative_to(path).as_posix()
        if _hidden(name) or not entry.is_file():
            continue
        found = _members(entry, max_unpacked) if entry.suffix.lower() == ".zip" else {name: entry.read_bytes}
        twice = sorted(set(found) & set(files))
        if twice:
            raise Problem(f"{path}: '{twice[0]}' is there twice, in {entry.name} and before it. Keep one of them.")
        files |= found
    return Tree(path, files)


def _members(path: Path, max_unpacked: int) -> dict[str, Callable[[], bytes]]:
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
        raise Problem(
            f"{path}: cannot be read as a zip archive ({error}). Copy it again, or pass the unpacked folder."
        ) from error
    for member in members:
        _refuse_unsafe(path, member)
    unpacked = sum(m.file_size for m in members)
    if unpacked > max_unpacked or len(members) > MOST_MEMBERS:
        raise Problem(
            f"{path}: unpacks to {unpacked / 1e9:.1f} GB in {len(members)} files, but at most "
            f"{max_unpacked / 1e9:.1f} GB in {MOST_MEMBERS} are accepted. Raise ingest.max_unpacked if it is honest."
        )
    plain = [m for m in members if not m.is_dir() and not _hidden(m.filename)]
    return {m.filename: _reader(path, m) for m in plain}


def _refuse_unsafe(path: Path, member: zipfile.ZipInfo) -> None:
    # `orig_filename`: zipfile itself has already cut the name at a null byte and turned backslashes round.
    names = (member.filename, member.orig_filename)
    climbs = any(".." in re.split(r"[/\\]", n) for n in names)
    absolute = any(n.startswith(("/", "\\")) or re.match(r"[A-Za-z]:", n) for n in names)
    if climbs or absolute or "\0" in member.orig_filename:
        raise Problem(
            f"{path}: member '{member.orig_filename}' points out of the archive's own folder, so nothing of it is read."
            " Pack the recording again with plain relative paths."
        )
    if stat.S_ISLNK(member.external_attr >> 16):
        raise Problem(f"{path}: member '{member.filename}' is a link, which is not followed. Pack the file itself.")
    if member.flag_bits & 0x1:
        raise Problem(f"{path}: member '{member.filename}' is encrypted. Pack the recording without a password.")
    if member.file_size > LARGEST_MEMBER or member.file_size > LARGEST_RATIO * max(member.compress_size, 1):
        raise Problem(
            f"{path}: member '{member.filename}' claims to unpack from {member.compress_size} to {member.file_size} "
            f"bytes, which no image does. Pack the recording again."
        )


def _reader(path: Path, member: zipfile.ZipInfo) -> Callable[[], bytes]:
    def read() -> bytes:
        try:
            with zipfile.ZipFile(path) as archive:
                # Reading stops at the size announced in the header and checks the sum.
                return archive.read(member)
        except (zipfile.BadZipFile, EOFError, ValueError, NotImplementedError, OSError) as error:
            raise Problem(
                f"{path}: member '{member.filename}' is damaged ({error}). Copy the archive again."
            ) from error

    return read


def _hidden(name: str) -> bool:
    parts = PurePosixPath(name).parts
    return any(p.startswith(".") for p in parts) or "__MACOSX" in parts
