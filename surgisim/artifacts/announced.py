"""Sizes that an .npz file announces, checked before memory is asked for."""

import math
import zipfile
import zlib

import numpy as np

DEFLATE = 1032
"""The most that Deflate can shrink anything."""
UNREADABLE = (zipfile.BadZipFile, zlib.error, EOFError, OSError, ValueError, KeyError, TypeError, AttributeError)
"""What reading a file that is no .npz, or a damaged one, raises."""


def check_announced(archive: zipfile.ZipFile, most: float = math.inf) -> None:
    """Every array's header announces as many bytes as its member holds, and all of them at most `most` [bytes].

    numpy makes room for what a header says before it reads, so a file of some bytes could ask for terabytes.
    Raises ValueError; a member that is no array, or holds objects, is left to numpy, which refuses it.
    """
    total = 0
    for member in archive.infolist():
        total += member.file_size
        if member.file_size > DEFLATE * (member.compress_size + 1):
            raise ValueError(f"{member.filename} claims {member.file_size} bytes in {member.compress_size}")
        with archive.open(member) as stream:
            if stream.read(6) != np.lib.format.MAGIC_PREFIX:
                continue
            stream.seek(0)
            version = np.lib.format.read_magic(stream)
            read = np.lib.format.read_array_header_1_0 if version[0] == 1 else np.lib.format.read_array_header_2_0
            shape, _, dtype = read(stream)
            announced = math.prod(shape) * dtype.itemsize
            if not dtype.hasobject and announced != member.file_size - stream.tell():
                raise ValueError(
                    f"{member.filename} announces {announced} bytes and holds {member.file_size - stream.tell()}"
                )
    if total > most:
        raise ValueError(f"its arrays take {total / 1e9:.1f} GB, and at most {most / 1e9:.1f} GB are read")
