"""A file under way, beside the one it becomes: nobody removes it while its writer lives."""

import contextlib
import fcntl
import os
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO


@contextlib.contextmanager
def partial(path: Path) -> Iterator[BinaryIO]:
    """An empty file of a name of its own beside `path`, for its writer to rename; it is gone at the end if it was not.

    Its lock falls with the writer, however that ends; a process number would say nothing to another machine that
    shares the folder, nor tell two threads of one process apart.
    """
    with _locked(path) as stream:
        try:
            yield stream
        finally:
            Path(stream.name).unlink(missing_ok=True)


def _locked(path: Path) -> BinaryIO:
    while True:
        stream = path.with_name(f".{path.name}.{secrets.token_hex(8)}.part").open("xb")
        # A file system without locks: then nobody gets one to clear it away either.
        with contextlib.suppress(OSError):
            fcntl.flock(stream, fcntl.LOCK_EX)
        # Between its making and its lock another one may have taken it for a dead process's.
        if os.fstat(stream.fileno()).st_nlink:
            return stream
        stream.close()


def clear_left(path: Path) -> None:
    """Remove what processes that were killed in mid-write left of `path`."""
    for left in path.parent.glob(f".{path.name}.*.part"):
        # Gone by now, or still locked by its writer.
        with contextlib.suppress(OSError), open(left, "r+b") as stream:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            left.unlink()
