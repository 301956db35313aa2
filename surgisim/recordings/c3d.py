"""Motion capture in C3D files, as most optical systems write them.

The C3D file format, user guide (2021), c3d.org: a header, a block of parameters, then every frame's points and
analogue samples, as real or scaled whole numbers. Read here: little-endian files ("Intel"), points only.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from surgisim.problem import Problem

BLOCK = 512
INTEL = 84
METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}


@dataclass(frozen=True)
class Markers:
    labels: tuple[str, ...]
    points: np.ndarray
    """Position of each marker, laboratory frame [m], (K, T, 3), NaN where it was not seen."""
    fps: float
    """[1/s]"""


def read_c3d(path: Path) -> Markers:
    """Markers of one take. Raises Problem for what is not a little-endian C3D file, or is cut short."""
    raw = path.read_bytes()
    if len(raw) < 2 * BLOCK or raw[1] != 0x50:
        raise Problem(f"{path}: is not a C3D file. Export the take as C3D.")
    start = (raw[0] - 1) * BLOCK
    if start + 4 > len(raw) or raw[start + 3] != INTEL:
        raise Problem(
            f"{path}: is not a little-endian C3D file, the only kind read here. Export it for Intel machines."
        )
    head = np.frombuffer(raw, "<u2", BLOCK // 2)
    count, analog, first, last, block = (int(head[i]) for i in (1, 2, 3, 4, 8))
    scale, fps = (float(x) for x in (head[6:8].view("<f4")[0], head[10:12].view("<f4")[0]))
    told = _parameters(raw, start, path)
    frames = last - first + 1
    unit = told.get(("POINT", "UNITS"), ["mm"])[0].strip().lower()
    if unit not in METRES:
        raise Problem(f"{path}: its lengths are in '{unit}', and {sorted(METRES)} are known here. Export it in metres.")
    kind = np.dtype("<f4" if scale < 0 else "<i2")
    width = 4 * count + analog
    begin = (block - 1) * BLOCK
    if frames < 1 or count < 1 or not fps > 0:
        raise Problem(f"{path}: holds {frames} frames of {count} markers at {fps:g} per second. Export the take again.")
    if begin + frames * width * kind.itemsize > len(raw):
        raise Problem(f"{path}: is cut short; {frames} frames are announced. Copy it again.")
    table = np.frombuffer(raw, kind, frames * width, begin).reshape(frames, width)[:, : 4 * count]
    table = table.reshape(frames, count, 4).astype(float)
    points = table[..., :3] * (METRES[unit] if scale < 0 else METRES[unit] * scale)
    points[table[..., 3] < 0] = np.nan
    names = [n.strip() for n in told.get(("POINT", "LABELS"), [])][:count]
    names += [f"marker {k + 1}" for k in range(len(names), count)]
    return Markers(tuple(names), np.moveaxis(points, 0, 1), fps)


def _parameters(raw: bytes, start: int, path: Path) -> dict[tuple[str, str], list[str]]:
    """The text parameters, by group and name, a list of strings each."""
    groups: dict[int, str] = {}
    texts = []
    at = start + 4
    while at + 2 <= len(raw) and raw[at] != 0:
        length, group = (int(x) for x in np.frombuffer(raw, "i1", 2, at))
        name = raw[at + 2 : at + 2 + abs(length)].decode("latin-1").upper()
        offset = at + 2 + abs(length)
        if offset + 4 > len(raw):
            raise Problem(f"{path}: its parameters are cut short. Copy it again.")
        if group < 0:
            groups[-group] = name
        elif raw[offset + 2] == 0xFF:
            sizes = list(raw[offset + 4 : offset + 4 + raw[offset + 3]])
            size, many = (sizes or [1])[0], int(np.prod(sizes[1:], dtype=int))
            data = raw[offset + 4 + len(sizes) :][: size * many].decode("latin-1")
            texts.append((group, name, [data[k * size : (k + 1) * size] for k in range(many)]))
        step = int.from_bytes(raw[offset : offset + 2], "little")
        if step == 0:
            break
        at = offset + step
    return {(groups.get(group, ""), name): text for group, name, text in texts}
