"""The small JSON files of a recording."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from surgisim.problem import Problem

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
STARTS = ("settled", "released")
EXPECTED = ("E", "eta / E")
"""Numbers of a base that may be known beforehand."""


def read_json(path: Path) -> dict[str, Any]:
    folder = path.parent
    if folder.is_file():
        raise Problem(
            f"{folder}: is a file, and a recording folder is wanted (docs/diagnosis.md). To diagnose a film: "
            f"surgisim run {folder} --diagnose."
        )
    if not folder.is_dir():
        raise Problem(f"{folder}: no such folder, but a recording (docs/diagnosis.md) is to be read from there.")
    if not path.is_file():
        raise Problem(f"{path}: no such file, but every recording has one. Add it.")
    try:
        body = json.loads(path.read_text("utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise Problem(f"{path}: is not JSON ({error}). Mend it.") from error
    if not isinstance(body, dict):
        raise Problem(f"{path}: holds a {type(body).__name__}, but an object in braces is wanted. Mend it.")
    return body


def facts(path: Path, expected: str) -> dict[str, Any]:
    """recording.json: name, fps, frames, unit [m], density, gravity, tier, starts, doubts, astray, expected."""
    body = read_json(path)
    needed = ("format", "name", "fps", "frames", "length_unit", "density_kg_m3", "gravity_m_s2", "tier")
    missing = [key for key in needed if key not in body]
    if missing:
        raise Problem(f"{path}: lacks {missing}. Add what is missing; what is not known is null.")
    if body["format"] != expected:
        raise Problem(f"{path}: its format is {body['format']!r}, and {expected!r} is read here. Write it anew.")
    name, unit = body["name"], body["length_unit"]
    if not isinstance(name, str) or not name:
        raise Problem(f"{path}: 'name' is {name!r}, but a word is wanted.")
    if not isinstance(body["tier"], str):
        raise Problem(f"{path}: 'tier' is {body['tier']!r}, but a word such as 'tracks' is wanted.")
    if not isinstance(unit, str) or unit not in UNITS:
        raise Problem(f"{path}: 'length_unit' is {unit!r}, and {sorted(UNITS)} are known.")
    fps, frames, density = body["fps"], body["frames"], body["density_kg_m3"]
    if not _number(fps) or fps <= 0:
        raise Problem(f"{path}: 'fps' is {fps!r}, but a number of frames per second above 0 is wanted.")
    if isinstance(frames, bool) or not isinstance(frames, int) or frames < 1:
        raise Problem(f"{path}: 'frames' is {frames!r}, but how many frames there are is wanted, at least 1.")
    if density is not None and (not _number(density) or density <= 0):
        raise Problem(f"{path}: 'density_kg_m3' is {density!r}, but a number above 0, or null, is wanted.")
    gravity = body["gravity_m_s2"]
    if gravity is not None and not _vector(gravity):
        raise Problem(f"{path}: 'gravity_m_s2' is {gravity!r}, but three numbers, or null, are wanted.")
    starts = body.get("starts", STARTS[0])
    if starts not in STARTS:
        raise Problem(f"{path}: 'starts' is {starts!r}, and {list(STARTS)} are known.")
    doubts = body.get("doubts", [])
    if not isinstance(doubts, list) or not all(isinstance(each, str) for each in doubts):
        raise Problem(f"{path}: 'doubts' is {doubts!r}, but a list of names is wanted.")
    astray = body.get("astray", 0.0)
    if not _number(astray) or astray < 0:
        raise Problem(f"{path}: 'astray' is {astray!r}, but a share of how far points go is wanted, 0 or more.")
    known = body.get("expected", {})
    if not isinstance(known, dict) or not all(name in EXPECTED and _span(s) for name, s in known.items()):
        raise Problem(
            f"{path}: 'expected' is {known!r}, but [low, high] above 0 of some of {list(EXPECTED)} is wanted."
        )
    return {
        "name": name,
        "expected": {name: (float(low), float(high)) for name, (low, high) in known.items()},
        "doubts": doubts,
        "astray": float(astray),
        "fps": float(fps),
        "frames": frames,
        "unit": UNITS[unit],
        "density": None if density is None else float(density),
        "gravity": None if gravity is None else tuple(map(float, gravity)),
        "tier": body["tier"],
        "starts": starts,
    }


def boxes_of(path: Path) -> np.ndarray:
    """fixed.json: lower and upper corners, (B, 2, 3)."""
    boxes = read_json(path).get("boxes")
    if not isinstance(boxes, list):
        raise Problem(f"{path}: lacks a list 'boxes'. Write {{\"boxes\": []}} where nothing is held.")
    for b, box in enumerate(boxes):
        if not isinstance(box, dict) or not all(_vector(box.get(k)) for k in ("min", "max")):
            raise Problem(f"{path}: box {b} is {box!r}, but 'min' and 'max' of three numbers each are wanted.")
        if any(low > high for low, high in zip(box["min"], box["max"], strict=True)):
            raise Problem(f"{path}: box {b} has a 'min' {box['min']} above its 'max' {box['max']}. Swap them.")
    return np.array([[box["min"], box["max"]] for box in boxes], float).reshape(-1, 2, 3)


def torn_of(path: Path) -> np.ndarray:
    """fixed.json: both ends of each wall through which tissue does not hang together, (K, 2, 2); none if not named."""
    walls = read_json(path).get("torn", [])
    if not isinstance(walls, list):
        raise Problem(f"{path}: 'torn' is {walls!r}, but a list of walls is wanted. Leave it out where there are none.")
    for k, wall in enumerate(walls):
        ends = (
            isinstance(wall, list) and len(wall) == 2 and all(isinstance(end, list) and len(end) == 2 for end in wall)
        )
        if not ends or not all(_number(value) for end in wall for value in end):
            raise Problem(f"{path}: wall {k} of 'torn' is {wall!r}, but two ends [x, y] are wanted.")
    return np.array(walls, float).reshape(-1, 2, 2)


def split_of(path: Path, frames: int) -> dict[str, tuple[int, int]]:
    """split.json: frames to fit and frames held out, first and one past the last, not overlapping."""
    body = read_json(path)
    spans = {}
    for name in ("fit", "held_out"):
        span = body.get(name)
        whole = isinstance(span, list) and len(span) == 2 and all(type(x) is int for x in span)
        if not whole or not 0 <= span[0] <= span[1] <= frames:
            raise Problem(f"{path}: '{name}' is {span!r}, but first and last + 1 of {frames} frames are wanted.")
        spans[name] = (span[0], span[1])
    fit, held_out = spans["fit"], spans["held_out"]
    if fit[0] == fit[1]:
        raise Problem(f"{path}: 'fit' is {list(fit)}, which leaves no frame to fit. Give it some.")
    if max(fit[0], held_out[0]) < min(fit[1], held_out[1]):
        raise Problem(f"{path}: 'fit' {list(fit)} and 'held_out' {list(held_out)} overlap. Keep them apart.")
    return spans


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _span(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(map(_number, value)) and 0 < value[0] < value[1]


def _vector(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(map(_number, value))
