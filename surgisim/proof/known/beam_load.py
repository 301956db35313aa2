"""A silicone beam with 52 g hung on its end sags further and rings more slowly than the bare one.

The base is what was fitted on the bare beam, damping included; the load is not in it.
"""

from pathlib import Path

from surgisim.artifacts.verdict import Effect
from surgisim.proof.known.catalogue import Answer, Found, Known, named

LOADS = ("added_mass", "hidden_contact")
LENGTH, MASS, GRAVITY = 0.1, 0.052, 9.807
"""Of the beam, whose free end is at z = 0 [m]; [kg], [m/s^2]."""
NEAR, OFF = 0.15, 0.20
"""Of the length, and of the mass."""


def convert(folder: Path):
    from surgisim.proof.recorded.clamped_beam import carried

    return carried(folder / "beam_load52_V2_a.c3d")


def hold_out(folder: Path):
    from surgisim.proof.recorded.clamped_beam import carried

    return carried(folder / "beam_load52_V2_b.c3d", "take-b")


def bare(folder: Path):
    from surgisim.proof.recorded.clamped_beam import carried

    return carried(folder / "beam_gravity_V2_a.c3d")


def ask(folder: Path, found: Found) -> list[Answer]:
    answers = [named(found.verdict, LOADS, "an added mass or a load")]
    load = next((e for e in found.verdict.effects if e.term in LOADS), None)
    if load is None or not answers[0].met:
        return answers
    return [*answers, _place(load), _mass(load)]


def _place(load: Effect) -> Answer:
    asked = f"at the free end, within {100 * NEAR:.0f} % of the length"
    if load.center is None:
        return Answer("its place", asked, "everywhere", False)
    # Along the beam; its end is a face, and where on the face does not matter.
    away = max(load.center[2], 0.0) / LENGTH
    return Answer("its place", asked, f"{100 * away:.0f} % of the length from the end", away <= NEAR)


def _mass(load: Effect) -> Answer:
    asked = f"52 g within {100 * OFF:.0f} %"
    entry = load.parameters.get("mass") or load.parameters.get("force")
    if entry is None:
        return Answer("its size", asked, "not given", False)
    mass = entry["value"] / (1.0 if "mass" in load.parameters else GRAVITY)
    return Answer(
        "its size", asked, f"{1e3 * mass:.1f} g ({100 * (mass / MASS - 1):+.0f} %)", abs(mass / MASS - 1) <= OFF
    )


KNOWN = Known(
    title="Silicone beam, the load on its end concealed",
    data="silicone_beam_mocap",
    concealed="52 g hang on the free end. The base is the bare beam's, fitted on another take.",
    convert=convert,
    hold_out=hold_out,
    bare=bare,
    ask=ask,
    # Three cells across the beam.
    settings={"grid": 0.23},
)
