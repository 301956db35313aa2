"""Settings of the estimation of physical parameters."""

from typing import Literal

from pydantic import Field

from surgisim.config.base import Settings


class Somewhere(Settings):
    """Where a law acts that does not act on the whole body."""

    center: tuple[float, float, float]
    """Middle of the blob, or a point of the plane; camera frame, rest [m]."""
    extent: float = Field(gt=0)
    """Standard deviation of the blob, or how gradually the plane's sides pass into each other [m]."""
    normal: tuple[float, float, float] | None = None
    """Into the side of a plane where the law acts; none for a blob [-]."""


class Estimation(Settings):
    """What is fitted, to what, and for how long."""

    enabled: bool = True
    """Whether to fit at all; without it every law keeps its default or `start` value [-]."""
    terms: list[str] = ["corotated", "newtonian"]
    """Laws of the body, by their file names in surgisim/physics/terms [-]."""
    start: dict[str, dict[str, float]] = {}
    """Law -> parameter -> value a fit starts from, instead of the law's default [the parameter's unit]."""
    places: dict[str, Somewhere] = {}
    """Law -> where it acts, for laws that act in one place; everywhere where not given [-]."""
    fixed: list[str] = []
    """'law.parameter' entries that keep their start value [-]."""
    support: bool = True
    """Whether to choose how deep and where the body is held by what fits the pull best [-]."""
    seen_rim: bool = True
    """Whether the edge of the picture may be carried as it is seen to go, where that fits far better elsewhere [-]."""
    pieces: bool = True
    """Whether tissue that goes along with a grip may be held by nothing below it, nor by what it is seen to slide past,
    where that fits far better [-]."""
    carrying: bool = True
    """Whether what is open of the grips (how far they come nearer, size, release) is fitted with the laws [-]."""
    brightness: bool = True
    """Whether the light of moving tissue counts: under a lamp at the camera it tells how the surface turns [-]."""
    density: float = Field(1050.0, gt=0)
    """Mass density of the tissue [kg/m^3]."""
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Acceleration in the camera frame; zero where frame 0 is in equilibrium under it [m/s^2]."""
    iterations: int = Field(6, ge=1, le=50)
    """Most Gauss-Newton iterations a round [-]."""
    first_window: float = Field(0.5, gt=0, le=1)
    """Share of the fitted frames that the first round sees, unless a pull and its release need more; each further round
    sees twice as many [-]."""
    field: list[str] = ["corotated.E", "newtonian.eta"]
    """'law.parameter' entries refined per particle, where that pays on frames kept from the refinement [-]."""
    field_iterations: int = Field(24, ge=0, le=200)
    """Adjoint iterations of the per-particle refinement at most, which ends where they no longer pay; 0 leaves
    parameters uniform [-]."""
    smoothness: float = Field(3.0, ge=0)
    """Weight of the total variation of per-particle parameters, against the data's misfit [-]."""
    image_weight: float = Field(0.5, ge=0)
    """Weight of the rendered image's L1 misfit beside the tracks' in the per-particle refinement [-]."""
    image_frames: int = Field(8, ge=0)
    """Frames rendered in each iteration of the refinement [-]."""
    form: Literal["total", "updated"] = "total"
    """How the method follows the tissue: weights fixed at rest, or the paper's, which has no adjoint [-]."""
    device: Literal["cpu", "cuda"] = "cpu"
    """Where the simulation runs [-]."""
    seed: int = 0
    """Seed of the choice of rendered frames [-]."""
