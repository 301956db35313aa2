"""The laws of a body with their numbers, and the discretisation they were fitted with."""

from dataclasses import dataclass, field
from typing import Any

from surgisim.artifacts.base import JsonArtifact, check


@dataclass(frozen=True)
class Physics(JsonArtifact):
    terms: dict[str, dict[str, dict[str, Any]]]
    """Law -> parameter -> {"value", "unit"}, the number that moves as recorded on this grid; and where the clip was
    asked "tissue", its own number, which is that without what a grid gets wrong, with its "low", "high", and
    "identifiable"."""
    density: float
    """[kg/m^3]"""
    gravity: list[float]
    """Camera frame [m/s^2], 3 numbers."""
    grid: dict[str, float]
    """{"spacing" [m], "step" [s]}: fitted numbers hold for these and travel with them."""

    grip: float = 1.0
    """How firmly instruments hold, as a share of the tissue's own stiffness; below 1 where a firmer grip would turn
    the tissue inside out, so that it slips instead [1]."""

    form: str = "total"
    """How the method follows the tissue: 'total' (weights fixed at rest) or 'updated' (the paper's)."""

    places: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Law -> {"center" [m], "extent" [m], "normal" or null} for laws that act in one place only."""

    ratios: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Of numbers that are told together better than apart, such as "eta / E": {"value", "low", "high", "unit"}."""

    alone: dict[str, dict[str, Any]] = field(default_factory=dict)
    """The base as it was found without what is named beside it, where it differs: "E", "nu", "eta" and "eta / E", each
    {"value", "low", "high", "unit"}. Another recording of the body begins with it."""

    UNITS = {"density": "kg/m^3", "gravity": "m/s^2"}

    def __post_init__(self) -> None:
        check(self.density > 0, f"Physics: density {self.density} must be > 0.")
        check(0 < self.grip <= 1, f"Physics: grip {self.grip} must be above 0 and at most 1.")
        check(self.form in ("total", "updated"), f"Physics: form '{self.form}' must be 'total' or 'updated'.")
        check(set(self.grid) == {"spacing", "step"}, f"Physics: grid has {sorted(self.grid)}, not spacing and step.")
