"""Where a law may act: on the whole body, in a layer of it, or in a blob."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from surgisim.diagnosis.form import APART, plane, scale
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.look import Look
from surgisim.physics.place import Place

BLOB = 0.0040
"""Extent of a blob that is tried [m], for a body of 36 mm; it follows the body's size."""
DEPTH = 0.3
"""Share of the depth below the observed side at which blobs are tried."""
SHARES = (0.75, 1.0, 1.35)
"""Of an extent, when a hypothesis is sharpened."""
LAYERS = (0.45,)
"""Share of the thickness at which a body is taken apart into a deep layer and an upper one."""
GRADUAL = 0.05
"""Of the thickness, over which one layer passes into the other."""


@dataclass(frozen=True)
class Where:
    scope: str
    place: Place | None = None

    def weight(self, rest: np.ndarray) -> np.ndarray:
        """Share of the law at rest points [m], (P, 3), between 0 and 1, (P,)."""
        return np.ones(len(rest)) if self.place is None else self.place.weight(rest)


EVERYWHERE = Where("everywhere")


def all_of(look: Look) -> list[Where]:
    """Everywhere, in either layer, in every blob."""
    return [EVERYWHERE, *layers(look), *blobs(look)]


def blobs(look: Look, depths: tuple[float, ...] = (DEPTH,)) -> list[Where]:
    """On the lattice over the observed side."""
    extent = BLOB * scale(look.clip)
    return [Where("blob", Place(tuple(c), extent)) for depth in depths for c in look.centers(depth)]


def layers(look: Look) -> list[Where]:
    """The deep one and the upper one, where a base tells which is which."""
    if not look.clip.body.held.any():
        return []
    up = look.clip.normal
    return [Where("layer", beyond(look, share, way)) for share in LAYERS for way in (-up, up)]


def beyond(look: Look, share: float, way: np.ndarray) -> Place:
    """All tissue on one side, `way`, of a plane that lies a share of the thickness above what is held."""
    clip, rest = look.clip, look.rest
    height = rest @ clip.normal
    bottom = float(height[clip.body.held].max())
    thick = float(np.percentile(height, 98)) - bottom
    center = rest.mean(0) + (bottom + share * thick - rest.mean(0) @ clip.normal) * clip.normal
    return Place(tuple(center), GRADUAL * thick, tuple(way))


def here(h: Hypothesis) -> Where:
    return Where(h.scope, h.place)


def around(look: Look, h: Hypothesis, step: float) -> list[Where]:
    """Beside where a hypothesis acts; `step` is a share of the coarse search's spacing. None for the whole body."""
    if h.place is None:
        return []
    if h.place.normal is not None:
        return list(_deeper(look, h, step))
    deep = np.concatenate([beside(look, h, step, d) for d in (-0.5, 0.0, 0.5)])
    found = []
    for share in SHARES:
        extent = share * h.place.extent
        found += [Where(h.scope, Place(tuple(c), extent)) for c in within(look, deep, extent)]
    return found


def _deeper(look: Look, h: Hypothesis, step: float) -> Iterator[Where]:
    for share in (-0.5, -0.25, 0.0, 0.25, 0.5):
        center = np.array(h.place.center) + share * step * APART * scale(look.clip) * look.clip.normal
        yield Where(h.scope, Place(tuple(center), h.place.extent, h.place.normal))


def beside(look: Look, h: Hypothesis, step: float, deep: float = 0.0) -> np.ndarray:
    """Places next to that of a hypothesis [m], (9, 3), some lattice spacings below it."""
    apart, (u, v) = 0.5 * step * APART * scale(look.clip), plane(look.clip)
    middle = np.array(h.place.center) - deep * apart * look.clip.normal
    return np.array([middle + apart * (a * u + b * v) for a in (-1, 0, 1) for b in (-1, 0, 1)])


def within(look: Look, centers: np.ndarray, extent: float) -> np.ndarray:
    """Those of some places, (Q, 3), that have tissue within an extent, or a cell."""
    body = look.clip.body
    free, reach = body.rest[~body.held], max(extent, body.spacing)
    return centers[[np.linalg.norm(free - c, axis=1).min() < reach for c in centers]]
