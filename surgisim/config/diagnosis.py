"""Settings of a diagnosis."""

from typing import Annotated, Literal

from pydantic import Field

from surgisim.config.base import Settings

Kinds = Literal[
    "release", "held", "lag", "scale", "drift", "place", "simulator", "grip radius", "grip centre", "grip firmness",
    "uneven grip", "grip path", "elastic law", "closing", "perception", "shape", "swing", "edge", "astray", "jumps",
]  # fmt: skip
"""What a recording leaves open, by name."""


class Diagnosing(Settings):
    """What the simulation lacks, where that is asked for: what is tried, and how noise is taken into account."""

    seed: int = Field(0, ge=0)
    """Seed of the simulated nulls and of whatever else is drawn [1]."""
    grid: float = Field(0.165, gt=0.04, le=0.5)
    """Spacing of the grid over the cube root of the body's volume [1]."""
    replay: float = Field(0.13, gt=0.04, le=0.5)
    """The same of the runs whose errors are shown, before and after, and of a second search where the first sees that
    something is hidden and not what; neither is made where it is no finer than `grid` [1]."""
    base: Literal["viscous", "elastic"] = "viscous"
    """What the simulation has already: E, nu and viscosity, or E and nu alone, so that damping may be missing; elastic
    only for bodies that swing [-]."""
    nulls: int = Field(24, ge=4, le=400)
    """Residuals of nothing but noise that go through the same search [1]."""
    refine: int = Field(4, ge=1, le=16)
    """Laws that the engine itself runs again, best first [1]."""
    free: int = Field(3, ge=0, le=16)
    """Of those, laws that are fitted at most with place, time, form and base free [1]."""
    budget: float = Field(5e9, gt=0)
    """Particles times steps that those fits take together, roughly: where bodies are large, clips long or tissue so
    viscous that steps are short, fewer laws are fitted that way, or none [1]."""
    second: bool = True
    """Whether a second effect is looked for [1]."""
    residual: bool = True
    """Whether what no law explains is modelled without a name; no verdict depends on it [1]."""
    noise: Literal["correlated", "independent"] = "correlated"
    """How tracking errors are taken to be related [-]."""
    offsets: bool = True
    """Whether every point may have a constant error of its own [1]."""
    without: Annotated[list[Kinds], Field(max_length=24)] = []
    """Kinds of nuisances that are left out, to see what each is worth [name]."""
    model_error: float = Field(1.0, ge=0, le=10)
    """Times the simulator's error as a finer grid shows it [1]."""
    cause: Literal["searched", "symptom"] = "searched"
    """Where local laws are tried: everywhere, or where the misfit is largest [-]."""
    calibrated: bool = True
    """Whether the thresholds of the calibration are used; without, any evidence above zero counts [1]."""
    device: Literal["cpu", "cuda"] = "cpu"
    """Where the engine runs [-]."""
    workers: int = Field(2, ge=1, le=64)
    """Runs side by side where the engine runs on a processor [1]."""
    experiment: bool = True
    """Whether a separating manipulation is simulated [1]."""
