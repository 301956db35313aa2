"""Binary PLY of one vertex element: what any viewer opens."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from surgisim.problem import Problem

TYPES = {"f4": "float", "f8": "double", "u1": "uchar", "i4": "int"}
NAMES = {v: k for k, v in TYPES.items()} | {"float32": "f4", "float64": "f8", "uint8": "u1", "int32": "i4"}


def write_ply(columns: dict[str, np.ndarray], header: dict[str, Any]) -> bytes:
    """Bytes of a little-endian PLY; one property a column, the artifact's header as a comment."""
    dtype = np.dtype([(name, np.asarray(c).dtype.newbyteorder("<")) for name, c in columns.items()])
    table = np.empty(len(next(iter(columns.values()))), dtype)
    for name, column in columns.items():
        table[name] = column
    lines = ["ply", "format binary_little_endian 1.0", f"comment surgisim {json.dumps(header, sort_keys=True)}"]
    lines.append(f"element vertex {len(table)}")
    lines += [f"property {TYPES[dtype[name].str[1:]]} {name}" for name in columns]
    return ("\n".join([*lines, "end_header"]) + "\n").encode() + table.tobytes()


def read_ply(path: Path) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Vertex columns and the artifact's header ({} when another program wrote the file)."""
    raw = path.read_bytes()
    end = raw.find(b"end_header\n")
    lines = raw[: max(end, 0)].decode("ascii", "replace").split("\n")
    if end < 0 or lines[0].strip() != "ply" or "format binary_little_endian 1.0" not in lines[1]:
        raise Problem(f"{path}: is not a binary little-endian PLY. Convert it, or pass the file a stage wrote.")
    header, fields, count, element = {}, [], 0, ""
    for words in (line.split() for line in lines[2:] if line.strip()):
        if words[:2] == ["comment", "surgisim"]:
            header = json.loads(" ".join(words[2:]))
        elif words[0] == "element":
            element = words[1]
            count = int(words[2]) if element == "vertex" else count
        elif words[0] == "property" and element == "vertex":
            if words[1] not in NAMES:
                raise Problem(f"{path}: property {words[-1]} has type {words[1]}, which is not read here.")
            fields.append((words[-1], "<" + NAMES[words[1]]))
    dtype = np.dtype(fields)
    body = raw[end + len(b"end_header\n") :]
    if len(body) < count * dtype.itemsize:
        raise Problem(f"{path}: is cut short; {count} vertices are announced. Run the stage that makes it again.")
    table = np.frombuffer(body, dtype, count)
    return {name: table[name].copy() for name in dtype.names or ()}, header
