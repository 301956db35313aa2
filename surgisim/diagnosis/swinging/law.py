"""What a law is that a swinging body is tried with, its numbers in units of the body's own."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from surgisim.diagnosis.clip import Clip
from surgisim.mpm.setup import Values
from surgisim.physics.place import Place

EXTENT, SEAM = 0.05, 0.02
"""Over the body's length: extent of tissue that differs in one place, and how gradually one part passes into the
other."""
ALWAYS = {"onset": 0.0, "end": 60.0}
ALONG = (0.0, 0.5)
"""Places of what acts in one place, from the free end (0) to what is held (1), that are tried before a fit."""
Made = tuple[Values, dict[str, Place]]


@dataclass(frozen=True)
class Law:
    """A way in which the base may be wrong."""

    term: str
    make: Callable[[np.ndarray], Made]
    """Values and places from its own numbers."""
    scan: tuple[tuple[float, ...], ...]
    """Values of each number that are tried before a fit."""
    low: tuple[float, ...]
    high: tuple[float, ...]
    called: Callable[[np.ndarray], str] | None = None
    """What a reader is told from its own numbers; its term if None."""
    divides: int | None = None
    """Which number the base's modulus is to be divided by, so that tissue near what is held keeps its own."""


@dataclass(frozen=True)
class Frame:
    """A body's own units."""

    free: np.ndarray
    """Middle of the end farthest from what is held [m], (3,)."""
    held: np.ndarray
    """Middle of what is held [m], (3,)."""
    down: np.ndarray
    """Where weight pulls, (3,); zero where nothing is known of it."""
    mass: float
    """[kg]"""
    weight: float
    """[N]"""
    period: float
    """[s]"""
    E: float
    """Of the base [Pa]."""
    finest: float
    """Half as wide as a particle [m]."""

    @property
    def length(self) -> float:
        return float(np.linalg.norm(self.held - self.free))

    @property
    def axis(self) -> np.ndarray:
        """From the free end to what is held, (3,)."""
        return (self.held - self.free) / self.length

    def along(self, share: float) -> tuple[float, float, float]:
        """In the middle, from the free end (0) to what is held (1) [m]."""
        x, y, z = self.free + float(share) * (self.held - self.free)
        return float(x), float(y), float(z)

    def somewhere(self, share: float) -> Place:
        return Place(self.along(share), EXTENT * self.length)

    def point(self, share: float) -> Place:
        """As small as the body resolves: what hangs on an end would otherwise act further in."""
        return Place(self.along(share), self.finest)


def frame_of(clip: Clip, x: np.ndarray, period: float) -> Frame:
    body = clip.body
    rest = body.rest.astype(float)
    held = rest[body.held].mean(0)
    away = np.linalg.norm(rest - held, axis=1)
    farthest = rest[away.argmax()]
    way = (farthest - held) / np.linalg.norm(farthest - held)
    # The face at the far end, not one of its corners; then straight along the body.
    reach = (rest - held) @ way
    end = rest[reach > reach.max() - body.spacing].mean(0)
    way = (end - held) / np.linalg.norm(end - held)
    # Up to the face, half a particle beyond the last of them.
    half = 0.5 * float(np.cbrt(np.median(body.volume)))
    free = held + way * (((rest - held) @ way).max() + half)
    gravity = np.array(clip.recording.gravity or (0.0, 0.0, 0.0))
    size = float(np.linalg.norm(gravity))
    mass = float(clip.density * body.volume.sum())
    down = gravity / size if size else gravity
    return Frame(free, held, down, mass, mass * (size or 9.81), period, float(np.exp(x[0])), half)
