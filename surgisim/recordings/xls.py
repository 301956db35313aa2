"""Numbers of old Excel workbooks (.xls), as many laboratories publish them.

[MS-CFB] and [MS-XLS], Microsoft's open specifications: a file of sectors holds the stream 'Workbook', a run of records;
a cell is one record, NUMBER, RK, MULRK or FORMULA. Read here: numbers; text and formats are passed over.
"""

import struct
from pathlib import Path

import numpy as np

from surgisim.problem import Problem

MAGIC = bytes.fromhex("d0cf11e0a1b11ae1")
END = 0xFFFFFFFA
"""Sectors from here on are marks, not sectors."""
BOUND_SHEET, NUMBER, RK, MULRK, FORMULA, BEGIN, STOP = 0x85, 0x203, 0x27E, 0xBD, 0x06, 0x809, 0x0A


def read_xls(path: Path) -> dict[str, np.ndarray]:
    """Sheet name -> numbers, (rows, columns), NaN where a cell holds none. Raises Problem for any other file."""
    raw = path.read_bytes()
    if raw[:8] != MAGIC:
        raise Problem(f"{path}: is not an .xls workbook. Save it as Excel 97-2004, or as text.")
    try:
        book = _stream(raw)
        return {name: _cells(book, at) for name, at in _sheets(book)}
    except (struct.error, IndexError, UnicodeDecodeError, MemoryError) as error:
        raise Problem(f"{path}: is a damaged .xls workbook ({error}). Copy it again.") from error


def _stream(raw: bytes) -> bytes:
    """The stream called Workbook."""
    size = 1 << struct.unpack_from("<H", raw, 30)[0]

    def sector(number: int) -> bytes:
        return raw[size * (number + 1) : size * (number + 2)]

    count, directory = struct.unpack_from("<I", raw, 44)[0], struct.unpack_from("<I", raw, 48)[0]
    table: list[int] = []
    for number in struct.unpack_from("<109I", raw, 76)[:count]:
        table += struct.unpack(f"<{size // 4}I", sector(number))

    def chain(number: int) -> bytes:
        parts = []
        while number < END and len(parts) <= len(table):
            parts.append(sector(number))
            number = table[number]
        return b"".join(parts)

    entries = chain(directory)
    for at in range(0, len(entries), 128):
        length = struct.unpack_from("<H", entries, at + 64)[0]
        if entries[at : at + max(length - 2, 0)].decode("utf-16le") == "Workbook":
            first, long = struct.unpack_from("<II", entries, at + 116)
            return chain(first)[:long]
    raise struct.error("no stream 'Workbook'")


def _records(book: bytes, at: int):
    while at + 4 <= len(book):
        kind, length = struct.unpack_from("<HH", book, at)
        yield kind, book[at + 4 : at + 4 + length]
        at += 4 + length


def _sheets(book: bytes) -> list[tuple[str, int]]:
    """Name and begin of each sheet."""
    found = []
    for kind, body in _records(book, 0):
        if kind == BOUND_SHEET:
            wide = body[7] & 1
            text = body[8 : 8 + body[6] * (2 if wide else 1)]
            found.append((text.decode("utf-16le" if wide else "latin-1"), struct.unpack_from("<I", body)[0]))
        if kind == STOP:
            return found
    return found


def _cells(book: bytes, at: int) -> np.ndarray:
    cells: dict[tuple[int, int], float] = {}
    for kind, body in _records(book, at):
        if kind == STOP:
            break
        if kind not in (NUMBER, RK, MULRK, FORMULA):
            continue
        row, column = struct.unpack_from("<HH", body)
        if kind == NUMBER:
            cells[row, column] = struct.unpack_from("<d", body, 6)[0]
        elif kind == RK:
            cells[row, column] = _rk(struct.unpack_from("<I", body, 6)[0])
        elif kind == MULRK:
            for k in range((len(body) - 6) // 6):
                cells[row, column + k] = _rk(struct.unpack_from("<I", body, 6 + 6 * k)[0])
        elif body[12:14] != b"\xff\xff":
            # A formula's last value, unless it is text or an error.
            cells[row, column] = struct.unpack_from("<d", body, 6)[0]
    rows, columns = (max((c[k] for c in cells), default=-1) + 1 for k in (0, 1))
    table = np.full((rows, columns), np.nan)
    for place, value in cells.items():
        table[place] = value
    return table


def _rk(number: int) -> float:
    """A packed number: a double without its lower half, or 30 bits of a whole one, either maybe over 100."""
    if number & 2:
        value = float(struct.unpack("<i", struct.pack("<I", number))[0] >> 2)
    else:
        value = struct.unpack("<d", b"\0\0\0\0" + struct.pack("<I", number & 0xFFFFFFFC))[0]
    return value / 100 if number & 1 else value
