"""The arrays of a recording's .npz files, each of the shape that the format says."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from surgisim.artifacts.announced import UNREADABLE, check_announced
from surgisim.problem import Problem

MOST = 4e9
"""Arrays of one file of a recording together [bytes]; measured tracks take megabytes."""


def arrays(path: Path, shapes: Mapping[str, str], frames: int, optional: tuple[str, ...] = ()) -> dict[str, np.ndarray]:
    """Arrays by name. A shape is a word: T is `frames`, 3 is 3, any other letter one length for the whole file.

    Nothing is unpickled. Raises Problem for a file that is no .npz, an array that is missing, no number, or of
    another shape.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            check_announced(archive.zip, MOST)
            found = {name: archive[name] for name in shapes if name in archive.files}
    except UNREADABLE as error:
        raise Problem(f"{path}: cannot be read as plain arrays ({error}). Write it with numpy.savez.") from error
    lengths = {"T": frames, "3": 3}
    for name, letters in shapes.items():
        if name not in found:
            if name in optional:
                continue
            raise Problem(f"{path}: lacks '{name}', a {_said(letters)} array. Add it.")
        array = found[name]
        if array.dtype.kind not in "biuf":
            raise Problem(f"{path}: '{name}' holds {array.dtype}, but numbers are wanted. Write it as numbers.")
        fits = array.ndim == len(letters) and all(
            lengths.setdefault(letter, size) == size for letter, size in zip(letters, array.shape, strict=True)
        )
        if not fits:
            known = ", ".join(f"{k} {v}" for k, v in lengths.items() if k != "3")
            raise Problem(f"{path}: '{name}' is {array.shape}, but {_said(letters)} is wanted, with {known}. Mend it.")
    return found


def _said(letters: str) -> str:
    return f"({', '.join(letters)}{',' if len(letters) == 1 else ''})"
