"""From a run's derivatives by particle and step to those by a law's few parameters.

A run knows theta, one row a particle, and the drive, one displacement a step. Both are made on the host from few
numbers: a law's parameters, and where it acts. The chain rule between them takes central differences of that making,
which costs no run.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from surgisim.mpm.grip import Drive
from surgisim.mpm.setup import Prepared, Values
from surgisim.mpm.simulator import Gradient
from surgisim.physics.catalogue import Param, choose
from surgisim.physics.place import Place
from surgisim.problem import Problem

SMALL = 1e-5
"""Step of the differences, as a share of what is varied."""


def by_parameters(
    prepared: Prepared,
    values: Values,
    places: Mapping[str, Place] | None,
    gradient: Gradient,
    make_drive: Callable[[Values], Drive] | None = None,
    *,
    held: np.ndarray | None = None,
) -> dict[str, dict[str, float | np.ndarray]]:
    """Law -> parameter -> derivative of the loss by it; 'center' [1/m], (3,), and 'extent' [1/m] of its place too.

    gradient: of a run with these values and places. make_drive: how the run's drive came from the values (the step
    must not change with them); None where the drive does not follow them. held: as for `Prepared.theta`.
    Raises Problem where the values change how firmly anchors hold and the gradient was taken without `springs`.
    """
    places = prepared.places if places is None else places
    start, result = 0, {}
    for name, term in choose(prepared.terms).items():
        alone = replace(prepared, terms=(name,))
        width = len(term.row(values[name]))
        theta_bar = gradient.theta[:, start : start + width]
        start += width

        def of_rows(numbers, where, name=name, alone=alone, theta_bar=theta_bar) -> float:
            return float((theta_bar * alone.theta({name: numbers}, where, held)).sum())

        # The anchors' own springs follow the moduli of laws that store energy.
        steers = make_drive is not None and (term.drive is not None or term.energy is not None)
        own: dict[str, float | np.ndarray] = {}
        for param, about in term.params.items():
            h = _step(values[name][param], about)
            up, down = ({**values[name], param: values[name][param] + s * h} for s in (1, -1))
            slope = of_rows(up, places) - of_rows(down, places)
            if steers:
                slope += _change(gradient, *(make_drive({**values, name: side}) for side in (up, down)))
            own[param] = slope / (2 * h)
        if name in places and width:
            h = SMALL * places[name].extent

            def shifted(by, wider=0.0, name=name, of_rows=of_rows) -> float:
                place = places[name]
                center = tuple(np.asarray(place.center, float) + by)
                moved = replace(place, center=center, extent=place.extent + wider)
                return of_rows(values[name], {**places, name: moved})

            own["center"] = np.array([shifted(h * e) - shifted(-h * e) for e in np.eye(3)]) / (2 * h)
            own["extent"] = (shifted(0.0, h) - shifted(0.0, -h)) / (2 * h)
        result[name] = own
    return result


def _step(value: float, about: Param) -> float:
    return SMALL * max(abs(value), 1e-3 * (about.high - about.low))


def _change(gradient: Gradient, up: Drive, down: Drive) -> float:
    """What a change of the drive does to the loss, to first order."""
    if up.step != down.step or up.path.shape != down.path.shape:
        raise Problem("chain: the drive's step changes with the values. Fix its steps per frame.")
    for kind in ("turn", "center", "member"):
        a, b = getattr(up, kind), getattr(down, kind)
        if (a is None) != (b is None) or (a is not None and not np.array_equal(a, b)):
            raise Problem(f"chain: the drive's {kind} changes with the values, by which a run has no derivative.")
    total = float((gradient.path * (up.path - down.path)).sum())
    for kind in ("hold", "stiffness"):
        change, by = getattr(up, kind) - getattr(down, kind), getattr(gradient, kind)
        if by is None and change.any():
            raise Problem(f"chain: the anchors' {kind} changes with the values. Take the gradient with springs=True.")
        total += float((by * change).sum()) if by is not None else 0.0
    return total
