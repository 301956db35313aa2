"""One search's view of a recording: what the laws look at, and what they share while they do."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from surgisim.diagnosis.base import Base
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import places
from surgisim.diagnosis.memo import NOTHING_KEPT, Memo


@dataclass(frozen=True)
class Look:
    clip: Clip
    base: Base
    memo: Memo = NOTHING_KEPT
    only: np.ndarray | None = None
    """Where alone local laws are tried [m], (3,); None for everywhere."""
    workers: int = 1
    """Runs of the engine side by side."""
    kept: dict[str, tuple[Any, Any]] = field(default_factory=dict, repr=False, compare=False)
    """The latest of every kind that laws share: which one it is, and what was made."""

    def once(self, kind: str, which: Any, make: Callable[[], Any]) -> Any:
        """What `make` makes, made anew only where the last of its kind was another one."""
        known = self.kept.get(kind)
        if known is None or known[0] != which:
            self.kept[kind] = known = (which, make())
        return known[1]

    def centers(self, depth: float = 0.15) -> np.ndarray:
        """Where local laws are tried [m], (Q, 3), a share of the depth below the observed side."""
        found = places(self.clip, depth=depth)
        return found if self.only is None else found[[np.linalg.norm(found - self.only, axis=1).argmin()]]

    @property
    def rest(self) -> np.ndarray:
        """Of the particles [m], (P, 3)."""
        return self.base.prepared.simulator.rest
