"""Binary PLY of vertices, and of triangles between them: what any viewer opens."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from surgisim.problem import Problem

DC = 0.28209479177387814
"""Value of the constant spherical harmonic: colour = 0.5 + DC * f_dc."""
SOLID = 0.95
"""Opacity of a particle drawn as a splat."""
TYPES = {"f4": "float", "f8": "double", "u1": "uchar", "i4": "int"}
NAMES = {v: k for k, v in TYPES.items()} | {"float32": "f4", "float64": "f8", "uint8": "u1", "int32": "i4"}


def write_ply(columns: dict[str, np.ndarray], header: dict[str, Any], faces: np.ndarray | None = None) -> bytes:
    """Bytes of a little-endian PLY; one property a column, the artifact's header as a comment; faces: triangles
    between vertices, (F, 3) int."""
    dtype = np.dtype([(name, np.asarray(c).dtype.newbyteorder("<")) for name, c in columns.items()])
    table = np.empty(len(next(iter(columns.values()))), dtype)
    for name, column in columns.items():
        table[name] = column
    lines = ["ply", "format binary_little_endian 1.0", f"comment surgisim {json.dumps(header, sort_keys=True)}"]
    lines.append(f"element vertex {len(table)}")
    lines += [f"property {TYPES[dtype[name].str[1:]]} {name}" for name in columns]
    listed = b""
    if faces is not None:
        lines += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
        rows = np.empty(len(faces), np.dtype([("count", "u1"), ("corners", "<i4", 3)]))
        rows["count"], rows["corners"] = 3, faces
        listed = rows.tobytes()
    return ("\n".join([*lines, "end_header"]) + "\n").encode() + table.tobytes() + listed


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


def splats(
    mean: np.ndarray, opacity: np.ndarray, scale: np.ndarray, rotation: np.ndarray, color: np.ndarray
) -> dict[str, np.ndarray]:
    """Columns of G Gaussians in the layout that viewers of splats read: centres [m], (G, 3), logits of opacity, (G,),
    logarithms of radii [m], (G, 3), quaternions w, x, y, z, (G, 4), and colours, sRGB 0-1, (G, 3)."""
    f4 = np.float32
    columns = {name: mean[:, i].astype(f4) for i, name in enumerate("xyz")}
    columns |= {name: np.zeros(len(mean), f4) for name in ("nx", "ny", "nz")}
    columns |= {f"f_dc_{i}": ((color[:, i] - 0.5) / DC).astype(f4) for i in range(3)}
    columns["opacity"] = opacity.astype(f4)
    columns |= {f"scale_{i}": scale[:, i].astype(f4) for i in range(3)}
    return columns | {f"rot_{i}": rotation[:, i].astype(f4) for i in range(4)}


def particles(place: np.ndarray, volume: np.ndarray, color: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of P particles, which viewers of points open as coloured points and viewers of splats as round splats as
    wide as they are: places [m], (P, 3), volumes [m^3], (P,), colours, sRGB 0-1, (P, 3)."""
    count = len(place)
    radius = np.repeat(np.log(0.5 * np.cbrt(volume.astype(float)))[:, None], 3, 1)
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    columns = splats(place, np.full(count, np.log(SOLID / (1 - SOLID))), radius, upright, color)
    rounded = np.rint(np.clip(color, 0, 1) * 255).astype(np.uint8)
    return columns | {name: rounded[:, k] for k, name in enumerate(("red", "green", "blue"))}
