"""The silicone beam's load put to the engine: what hangs on its end."""

import math
from pathlib import Path

import numpy as np

from surgisim.mpm.setup import Values
from surgisim.physics.place import Place
from surgisim.proof.known.catalogue import Found
from surgisim.proof.rigs.clamped_beam import carried
from surgisim.proof.rigs.let_go import Law, misfit, name, rms, simulate
from surgisim.recordings.recording import Recording
from surgisim.verification.silicone_beam import above_rest, read
from surgisim.verification.silicone_take import FPS, GRAVITY, MAKERS_E, take, tip

SPACING = 0.010
"""Three cells across the beam [m]."""
NU = 0.45
SECONDS = 0.7
"""Fitted, and predicted on the other take, from the release on: loads show at once [s]."""
EXTENT = 0.005
"""Of a law that acts somewhere [m]."""
LENGTH, MIDDLE = 0.1, 0.015
"""Of the beam, and half its thickness [m]."""
ALONG = (0.0, 0.05)
"""Places along the beam that are tried before a fit, from the free end [m]."""


def elastic(E: float) -> Values:
    return {"corotated": {"E": E, "nu": NU}}


def concealed_load(folder: Path, progress) -> Found:
    """Base: the bare beam's modulus and viscosity, fitted on another take."""
    bare = carried(folder / "beam_gravity_V2_a.c3d")
    E = tuned(folder / "beam_gravity_V2_a.c3d", bare, 7.6)
    eta = viscosity(bare, E)
    base = elastic(E) | {"newtonian": {"eta": eta}}
    first, second = (carried(folder / f"beam_load52_V2_{k}.c3d") for k in "ab")
    laws = [mass(), push(first), heavier(first), lump()]
    return name(laws, base, first, second, SPACING, SECONDS, progress)


def tuned(path: Path, recording: Recording, frequency: float) -> float:
    """The modulus whose frequency is the recorded one [Pa]: frequencies go with its root."""
    aim, E = read(above_rest(take(path)), frequency).frequency, MAKERS_E
    for _ in range(2):
        y = tip(simulate(recording, elastic(E), {}, SPACING, round(SECONDS * FPS) + 1))
        E *= (aim / read(y - y.mean(), frequency, 0.05, SECONDS, ()).frequency) ** 2
    return E


def viscosity(bare: Recording, E: float) -> float:
    """[Pa s], by golden sections of the misfit to the bare beam."""
    frames, ratio = round(SECONDS * FPS) + 1, (math.sqrt(5) - 1) / 2

    def off(log_eta: float) -> float:
        values = elastic(E) | {"newtonian": {"eta": math.exp(log_eta)}}
        return rms(misfit(bare, simulate(bare, values, {}, SPACING, frames)))

    low, high = math.log(50.0), math.log(1500.0)
    a, b = high - ratio * (high - low), low + ratio * (high - low)
    off_a, off_b = off(a), off(b)
    for _ in range(4):
        if off_a < off_b:
            high, b, off_b = b, a, off_a
            a = high - ratio * (high - low)
            off_a = off(a)
        else:
            low, a, off_a = a, b, off_b
            b = low + ratio * (high - low)
            off_b = off(b)
    return math.exp((low + high) / 2)


def lump() -> Law:
    def make(x):
        return {"stiff_inclusion": {"s": x[0]}}, {"stiff_inclusion": somewhere(x[1])}

    return Law("stiff_inclusion", make, ((0.1, 0.3, 3.0), ALONG), (0.05, 0.0), (50.0, LENGTH))


def mass() -> Law:
    def make(x):
        return {"added_mass": {"mass": x[0]}}, {"added_mass": somewhere(x[1])}

    return Law("added_mass", make, ((0.01, 0.03, 0.06, 0.1), ALONG), (1e-5, 0.0), (0.2, LENGTH))


def push(recording: Recording) -> Law:
    """A force the way gravity goes."""
    down = np.array(recording.gravity) / GRAVITY
    yaw, pitch = math.atan2(down[0], down[2]), math.asin(down[1])

    def make(x):
        told = {"force": x[0], "yaw": yaw, "pitch": pitch, "onset": 0.0, "end": 60.0}
        return {"hidden_contact": told}, {"hidden_contact": somewhere(x[1])}

    return Law("hidden_contact", make, ((0.1, 0.3, 0.6, 1.0), ALONG), (1e-3, 0.0), (10.0, LENGTH))


def heavier(recording: Recording) -> Law:
    """A gravity that is not the one assumed."""
    down = np.array(recording.gravity) / GRAVITY

    def make(x):
        return {"gravity": {**dict(zip("xyz", (x[0] * down).tolist(), strict=True)), "onset": -1.0}}, {}

    return Law("gravity", make, ((1.0, 5.0, 14.0),), (-15.0,), (15.0,))


def somewhere(along: float) -> Place:
    """In the middle of the cross-section, `along` from the free end [m]."""
    return Place((MIDDLE, MIDDLE, float(along)), EXTENT)
