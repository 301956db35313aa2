"""Settings of a simulation."""

from typing import Literal

from pydantic import Field

from surgisim.config.base import Settings


class Simulation(Settings):
    """How a replay or a new operation is run and drawn."""

    operation: dict | None = None
    """A new operation (docs/operations.md); null replays the recorded one [-]."""
    solver: str = "mpm"
    """What moves the tissue: the material point method with the fitted laws (mpm), or, to hold it against, masses and
    springs of the same stiffness and viscosity: a file of surgisim/baselines, point_cloud or mesh [name]."""
    render: bool = True
    """Whether to draw the frames [-]."""
    interior: bool = True
    """Whether to draw the thickened interior where the surface opens: in a cut, or behind a flap that moves [-]."""
    relight: bool = True
    """Whether shading and highlights follow the moved surface under a lamp at the camera, as far as that makes
    pictures of the recording nearer, or ride on the tissue [-]."""
    refine_step: int = Field(1, ge=1, le=100)
    """Divide the step that travels with the parameters by this, to see that the answer does not depend on it [-]."""
    device: Literal["cpu", "cuda"] = "cpu"
    """Where the simulation runs [-]."""
