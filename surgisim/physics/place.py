"""Where a law acts: from a few numbers to one row a particle."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from surgisim.physics.catalogue import Numbers, Term
from surgisim.problem import Problem

FARTHEST = 1e-6
"""Share of a place below which all is as far away."""


class Misplaced(Problem):
    """A law acts where no tissue is."""


@dataclass(frozen=True)
class Place:
    """A blob exp(-d^2 / (2 extent^2)) around a rest position, or all that lies beyond a plane through it.

    Beyond a plane, d the distance along its normal, the share is (1 + tanh(d / extent)) / 2.
    """

    center: tuple[float, float, float]
    """[m]"""
    extent: float
    """Standard deviation, or how gradually one side passes into the other [m]."""
    normal: tuple[float, float, float] | None = None
    """Into the side where the law acts; none for a blob."""

    def weight(self, rest: np.ndarray) -> np.ndarray:
        """Share of the law at rest points [m], (P, 3), between 0 and 1, (P,)."""
        arm = np.asarray(rest, float) - np.asarray(self.center, float)
        if self.normal is not None:
            way = np.asarray(self.normal, float)
            return 0.5 * (1 + np.tanh(arm @ (way / np.linalg.norm(way)) / self.extent))
        return np.exp(-0.5 * ((arm**2).sum(1) / self.extent**2))


def rows(
    terms: Mapping[str, Term],
    values: Mapping[str, Numbers],
    places: Mapping[str, Place],
    rest: np.ndarray,
    volume: np.ndarray,
    masks: Mapping[str, np.ndarray] | None = None,
) -> np.ndarray:
    """Columns of all laws at every particle, (P, M).

    A column whose parameter has an off value fades to it outside the law's place, unless it stays or grows there; a
    total is shared out over the place, per cubic metre. masks: 'held' and 'surface', (P,) bool, for laws that act there
    only. Raises Problem where a law that needs a place has none, Misplaced where the place misses the body.
    """
    result = []
    for name, term in terms.items():
        place = places.get(name)
        if place is None and term.place == "somewhere":
            raise Problem(
                f"law '{name}' acts at one place, and none is given. Give its centre and extent [m] under 'places'."
            )
        if place is not None and term.place == "everywhere":
            raise Problem(f"law '{name}' acts on the whole body, but a place is given for it. Leave the place away.")
        there = np.ones(len(rest)) if place is None else place.weight(rest)
        mine = np.ones(len(rest)) if term.on == "body" else 1.0 * (masks or {}).get(term.on, np.zeros(len(rest)))
        weight = there * mine
        shared, whole = (float((w * volume).sum()) for w in (weight, mine))
        if shared < 1e-6 * float(volume.sum()):
            raise Misplaced(f"law '{name}' finds no tissue to act on: {_where(place, term)}.")
        row = term.row(values[name])
        if term.spread is not None:
            row |= term.spread(rest, **values[name])
        for column, value in row.items():
            param = term.params.get(column)
            if param is not None and param.outside != "fades":
                each = value * mine / (whole if param.total else 1.0)
                result.append(each if param.outside == "stays" else each / np.maximum(there, FARTHEST))
            elif param is not None and param.total:
                result.append(value * weight / shared)
            elif param is not None and param.off is not None:
                result.append(param.off + (value - param.off) * weight)
            else:
                result.append(np.broadcast_to(np.asarray(value, float), len(rest)))
    return np.stack(result, -1) if result else np.zeros((len(rest), 0))


def _where(place: Place | None, term: Term) -> str:
    kind = {"body": "", "held": " that the base holds", "surface": " on the seen surface"}[term.on]
    if place is None:
        return f"the body has none{kind}. Mark some, or leave the law out"
    return (
        f"its place at {np.round(place.center, 4).tolist()} m with extent {place.extent:.4f} m holds none{kind}. "
        "Move it into the body, or enlarge it"
    )
