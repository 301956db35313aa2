"""What an estimation writes of the laws: material.npz and physics.json."""

from collections.abc import Mapping
from dataclasses import asdict

import numpy as np

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.fit import Fit
from surgisim.artifacts.material import Material
from surgisim.artifacts.physics import Physics
from surgisim.config.estimation import Estimation
from surgisim.estimation.search import Search
from surgisim.estimation.trial import SAFETY
from surgisim.mpm.setup import Prepared, Values
from surgisim.physics.catalogue import choose, columns
from surgisim.physics.place import Place


def physics_of(
    prepared: Prepared, values: Values, table: dict, settings: Estimation, step: float, grip: float = 1.0
) -> Physics:
    """Laws and numbers as found: what is simulated, and beside it what is known of the tissue itself.

    table: what each number is and whether it can be told, see identify.py; step: of the simulation [s].
    """
    terms = {}
    for law, term in choose(prepared.terms).items():
        terms[law] = {}
        for name, p in term.params.items():
            entry = {"value": values[law][name], "unit": p.unit}
            known = table.get(f"{law}.{name}")
            if known:
                entry |= {"tissue": known["value"], "low": known["low"], "high": known["high"]}
                entry["identifiable"] = known["told"]
            terms[law][name] = entry
    grid = {"spacing": prepared.simulator.grid.spacing, "step": step}
    return Physics(terms, settings.density, list(settings.gravity), grid, grip, settings.form, _told(prepared.places))


def _told(places: Mapping[str, Place]) -> dict:
    """Places as physics.json holds them."""
    return {law: asdict(place) for law, place in places.items()}


def unfitted(
    prepared: Prepared, wanted: Search, settings: Estimation, camera: Camera, why: str
) -> tuple[Material, Physics, Fit]:
    """The same of a body that nothing can be learned of, and why, with default numbers."""
    values = wanted.values(wanted.start)
    names = np.array(columns(choose(prepared.terms)))
    material = Material(names, prepared.theta(values).astype(np.float32), prepared.body.held)
    step = 1 / camera.fps / prepared.per_frame(values, camera.fps, SAFETY)
    return material, physics_of(prepared, values, {}, settings, step), Fit([], {}, {}, why)
