"""Finished runs, kept in a folder, so that an interrupted diagnosis goes on where it stopped."""

import hashlib
import io
import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from surgisim.artifacts.base import save_bytes


@dataclass(frozen=True)
class Memo:
    folder: Path | None
    """None keeps nothing."""
    about: str
    """What all entries depend on: digests of recording, settings and code."""
    making: dict[str, Lock] = field(default_factory=dict, repr=False, compare=False)
    """Of each entry: a thread that wants what another one is making waits for it."""

    def on(self, grid: float) -> "Memo":
        """The same folder for runs on a grid of another spacing, over the cube root of the body's volume."""
        return replace(self, about=f"{self.about} {grid}")

    def without(self, point: int) -> "Memo":
        """The same folder for tracks of all points but one; a run's tracks are of the points that were looked at."""
        return replace(self, about=f"{self.about} without point {point}")

    def __call__(self, what: Any, make: Callable[[], dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
        """The arrays made for `what` (JSON-able), from the folder if they are there."""
        if self.folder is None:
            return make()
        key = hashlib.sha256(json.dumps([self.about, what], sort_keys=True).encode()).hexdigest()[:20]
        path = self.folder / f"{key}.npz"
        with self.making.setdefault(key, Lock()):
            if path.is_file():
                with np.load(path, allow_pickle=False) as archive:
                    return dict(archive)
            made = make()
            stream = io.BytesIO()
            np.savez(stream, **made)
            save_bytes({path: stream.getvalue()})
        return made


NOTHING_KEPT = Memo(None, "")
