"""The bar of two silicones put to the engine: what a bar of one silicone lacks.

What is seen is where it came to rest. Drag brings it there in little time, and is gone at rest.
Every law is fitted together with the bar's one modulus, to every other point of the midline; the points between are
held out, for there is no second picture of this bar hanging.
"""

import dataclasses
import math

import numpy as np
from scipy.optimize import minimize_scalar

from surgisim.mpm.setup import Values
from surgisim.physics.place import Place
from surgisim.proof.known.catalogue import Found, Panel, curve
from surgisim.proof.recorded.hanging_beam import BAR, SEEN
from surgisim.proof.rigs.let_go import Law, misfit, name, rms, simulate
from surgisim.recordings.recording import Recording

SPACING = 0.009
"""Three cells across the bar [m]."""
NU = 0.45
DRAG = 10.0
"""[1/s]; with 8 a bar of 80 kPa is within .5 mm of rest after 2 s."""
SEAM = 0.002
"""How gradually one part passes into the other [m]."""
HEAD, EXTENT = -0.08, 0.01
"""Middle of the free head along the bar, and extent of what acts in one place [m]."""
SOFTEST, STIFFEST = 1e4, 1e6
"""[Pa]"""
EVALUATIONS = 10
"""Of a fit; a modulus, a factor and a place follow one another slowly."""


def concealed_halves(bar: Recording, progress) -> Found:
    """Base: one silicone, its modulus from the same picture."""
    seconds = (bar.frames - 1) / bar.fps
    fitted, between = (some(bar, slice(k, None, 2)) for k in (0, 1))
    progress(0, 1, "one silicone")
    E = one_modulus(fitted)
    laws = [part(E), head(E), tilt(E), stiffening(E), push(E)]
    return name(
        laws,
        silicone(E),
        fitted,
        between,
        SPACING,
        seconds,
        progress,
        other_is="points between those that were fitted",
        evaluations=EVALUATIONS,
        draw=midline,
    )


def midline(bar: Recording, base: np.ndarray, named: np.ndarray) -> Panel:
    """Where the points came to rest, seen from the side."""
    seen = bar.points.astype(float) - bar.attached()[:, None]
    shapes = [1e3 * (bar.attached() + moved[:, -1])[:, :2].T for moved in (seen, base, named)]
    words = "where the points between those that were fitted came to rest"
    return Panel(words, "towards the clamp [mm]", "up [mm]", *(curve(*shape) for shape in shapes))


def some(bar: Recording, which: slice) -> Recording:
    """Some of its points, seen at the end only."""
    points, visible = bar.points[which].copy(), bar.visible[which].copy()
    points[:, :-SEEN], visible[:, :-SEEN] = np.nan, False
    return dataclasses.replace(bar.of(which), points=points, visible=visible)


def silicone(E: float) -> Values:
    return {"corotated": {"E": float(E), "nu": NU}, "drag": {"c": DRAG}}


def one_modulus(bar: Recording) -> float:
    """The modulus of one silicone with which the bar hangs most nearly as it does [Pa]."""

    def off(log_E: float) -> float:
        return rms(misfit(bar, simulate(bar, silicone(math.exp(log_E)), {}, SPACING, bar.frames)))

    span = np.log([2 * SOFTEST, STIFFEST / 3])
    return math.exp(minimize_scalar(off, bounds=span, method="bounded", options={"maxiter": 9, "xatol": 0.05}).x)


def _law(term: str, E: float, make, scan, low, high) -> Law:
    """make: values of the law and its place from its own numbers; before them goes the modulus over E."""

    def whole(x):
        values, place = make(x[1:])
        return {**silicone(x[0] * E), term: values}, {} if place is None else {term: place}

    return Law(term, whole, ((1.0,), *scan), (SOFTEST / E, *low), (STIFFEST / E, *high))


def part(E: float) -> Law:
    """Stiffer or softer from some place on to the clamp; the modulus is the one there, where the bar bends most."""

    def make(x):
        values = {**silicone(x[0] * E / x[1]), "stiff_inclusion": {"s": float(x[1])}}
        return values, {"stiff_inclusion": Place(along(x[2]), SEAM, (1.0, 0.0, 0.0))}

    scan = ((1.0,), (0.4, 2.5), (0.25, 0.5, 0.75))
    return Law("stiff_inclusion", make, scan, (SOFTEST / E, 0.06, 0.08), (STIFFEST / E, 16.0, 1.0))


def head(E: float) -> Law:
    """A weight in the free head."""
    place = Place((HEAD, 0.0, 0.0), EXTENT)
    return _law("added_mass", E, lambda x: ({"mass": 0.1 * float(x[0])}, place), ((0.1, 0.3),), (1e-4,), (2.0,))


def tilt(E: float) -> Law:
    """A camera that does not hang as was thought."""
    return _law(
        "gravity", E, lambda x: ({"x": float(x[0]), "y": 0.0, "z": 0.0, "onset": -1.0}, None),
        ((-2.0, 2.0),), (-9.0,), (9.0,),
    )  # fmt: skip


def stiffening(E: float) -> Law:
    return _law("stiffening", E, lambda x: ({"k": E * float(x[0])}, None), ((0.1, 0.5),), (10 / E,), (1e5 / E,))


def push(E: float) -> Law:
    """Something holds it up from below."""
    up = {"yaw": 0.0, "pitch": math.pi / 2, "onset": 0.0, "end": 60.0}

    def make(x):
        return {"force": float(x[0]), **up}, Place(along(x[1]), EXTENT)

    return _law("hidden_contact", E, make, ((0.05, 0.2), (0.25, 0.75)), (1e-3, 0.08), (2.0, 1.0))


def along(share: float) -> tuple[float, float, float]:
    """In the middle of the cross-section, from the free head (0) to the clamp (1) [m]."""
    return (float(share) - 0.5) * BAR, 0.0, 0.0
