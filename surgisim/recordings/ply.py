"""Triangle meshes in PLY files: ASCII or binary, of either byte order, whoever wrote them."""

from pathlib import Path

import numpy as np

from surgisim.problem import Problem
from surgisim.recordings.mesh import Mesh

TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"}
TYPES |= {"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"}
TYPES |= {"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"}
ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}


def write_mesh(mesh: Mesh) -> bytes:
    """A little-endian PLY in double precision."""
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(mesh.vertices)}"]
    head += [f"property double {a}" for a in "xyz"]
    head += [f"element face {len(mesh.faces)}", "property list uchar int vertex_indices", "end_header"]
    faces = np.empty(len(mesh.faces), [("n", "u1"), ("v", "<i4", 3)])
    faces["n"], faces["v"] = 3, mesh.faces
    return ("\n".join(head) + "\n").encode() + mesh.vertices.astype("<f8").tobytes() + faces.tobytes()


def read_mesh(path: Path) -> Mesh:
    """Vertices and triangles of a PLY; other properties and elements are passed over."""
    raw = path.read_bytes()
    order, elements, body = _header(raw, path)
    vertices = faces = None
    words = raw[body:].split() if order == "=" else None
    at = 0 if order == "=" else body
    for name, count, properties in elements:
        if vertices is not None and faces is not None:
            break
        read = _text if words is not None else _binary
        table, at = read(raw if words is None else words, at, count, properties, order, path, name)
        if name == "vertex":
            missing = [a for a in "xyz" if a not in table]
            if missing:
                raise Problem(f"{path}: its vertices lack {missing}. Export the mesh again.")
            vertices = np.stack([table[a].astype(float) for a in "xyz"], 1)
        elif name == "face":
            faces = next((table[n] for n in ("vertex_indices", "vertex_index") if n in table), None)
            if faces is None:
                raise Problem(f"{path}: its faces have no list 'vertex_indices'. Export the mesh again.")
    if vertices is None or faces is None:
        raise Problem(f"{path}: holds no vertices or no faces, but a closed triangle mesh is wanted.")
    return Mesh(vertices, faces.astype(int))


def _header(raw: bytes, path: Path):
    end = raw.find(b"end_header")
    lines = [line.split() for line in raw[: max(end, 0)].decode("latin-1").splitlines()]
    if end < 0 or not lines or lines[0] != ["ply"]:
        raise Problem(f"{path}: is not a PLY file. Write the closed mesh of the body as PLY.")
    order, elements = None, []
    for line in lines[1:]:
        if line[:1] == ["format"]:
            order = ORDERS.get(line[1]) if len(line) > 1 else None
        elif line[:1] == ["element"] and len(line) == 3 and line[2].isdigit():
            elements.append((line[1], int(line[2]), []))
        elif line[:1] == ["property"] and elements:
            kinds = line[2:-1] if line[1] == "list" else line[1:-1]
            if len(kinds) != (2 if line[1] == "list" else 1) or any(k not in TYPES for k in kinds):
                raise Problem(f"{path}: property '{' '.join(line)}' is not one that PLY knows. Export the mesh again.")
            elements[-1][2].append((line[-1], [TYPES[k] for k in kinds]))
    if order is None:
        raise Problem(f"{path}: its header names no format that PLY knows. Export the mesh again.")
    return order, elements, raw.index(b"\n", end) + 1


def _binary(raw: bytes, at: int, count: int, properties, order: str, path: Path, name: str):
    fields = []
    for field, kinds in properties:
        if len(kinds) == 1:
            fields.append((field, order + kinds[0]))
            continue
        # Every list is taken to be a triangle's and the counts are checked below.
        fields += [(f"{field}#", order + kinds[0]), (field, order + kinds[1], 3)]
    dtype = np.dtype(fields)
    if at + count * dtype.itemsize > len(raw):
        raise _short(path, count, name)
    table = np.frombuffer(raw, dtype, count, at)
    for field, kinds in properties:
        if len(kinds) == 2 and (table[f"{field}#"] != 3).any():
            raise _corners(path, int(table[f"{field}#"][table[f"{field}#"] != 3][0]))
    return {f: table[f] for f in dtype.names}, at + count * dtype.itemsize


def _text(words: list[bytes], at: int, count: int, properties, order: str, path: Path, name: str):
    width = sum(1 if len(kinds) == 1 else 4 for _, kinds in properties)
    if at + count * width > len(words):
        raise _short(path, count, name)
    try:
        table = np.array(words[at : at + count * width]).astype(float).reshape(count, width)
    except ValueError as error:
        raise Problem(
            f"{path}: its {name} list holds something that is no number ({error}). Export it again."
        ) from error
    read, column = {}, 0
    for field, kinds in properties:
        if len(kinds) == 1:
            read[field] = table[:, column]
            column += 1
            continue
        if (table[:, column] != 3).any():
            raise _corners(path, int(table[:, column][table[:, column] != 3][0]))
        read[field] = table[:, column + 1 : column + 4]
        column += 4
    return read, at + count * width


def _short(path: Path, count: int, name: str) -> Problem:
    return Problem(f"{path}: is cut short; {count} of '{name}' are announced. Copy or export it again.")


def _corners(path: Path, corners: int) -> Problem:
    return Problem(f"{path}: a face has {corners} corners, but triangles are wanted. Triangulate the mesh.")
