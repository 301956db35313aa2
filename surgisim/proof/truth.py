"""Opening what a case conceals, once its seal has been checked."""

import hashlib
import io
import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from surgisim.phantom.seal import verify
from surgisim.problem import Problem

FORMAT = "surgisim-blind-truth/1"


@dataclass(frozen=True)
class Truth:
    """What was concealed, in the words of truth.json."""

    told: dict[str, Any]
    plain: np.ndarray
    """Noise-free paths without the effects [m], (K, T, 3)."""
    true: np.ndarray
    """Noise-free paths with them."""

    @property
    def effects(self) -> list[dict[str, Any]]:
        return self.told["effects"]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(e["term"] for e in self.effects)


def opened(truth: bytes, tracks: bytes, salt: str, seal: str, published: str) -> Truth:
    """The truth, after its seal and the run's log of seals, published before any diagnosis, are found to match.

    Raises Problem otherwise, and nothing can be scored.
    """
    verify(truth, salt.strip(), seal)
    if not any(seal.strip() in line.split() for line in published.splitlines()):
        raise Problem(
            f"the seal {seal.strip()[:12]}... is not in the log of seals that was written before the diagnoses. "
            "Nothing can be scored against it; run all cases again with another seed."
        )
    told = json.loads(truth)
    if told.get("format") != FORMAT:
        raise Problem(f"truth.json: its format is {told.get('format')!r}, and {FORMAT!r} is read here.")
    if hashlib.sha256(tracks).hexdigest() != told["tracks_sha256"]:
        raise Problem("truth.npz is not the file that the sealed truth.json names. Nothing can be scored against it.")
    with np.load(io.BytesIO(tracks), allow_pickle=False) as archive:
        return Truth(told, archive["plain"].astype(float), archive["true"].astype(float))
