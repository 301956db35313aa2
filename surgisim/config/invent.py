"""Settings of the blind generators: one concealed recording, or one clip, of a seed."""

from typing import Annotated, Literal

from pydantic import Field

from surgisim.config.base import Settings

FAMILIES = ("tetrahedra", "springs", "lattice")
"""Of surgisim/phantom/families, by what computes them."""


class Concealing(Settings):
    """What is concealed, and how it stands out."""

    seed: int = Field(1, ge=0)
    """Decides all cases [1]."""
    case: int = Field(0, ge=0)
    """Number of the case; twenty in a row hold the whole mixture [1]."""
    noise: float = Field(3e-4, ge=0)
    """Standard deviation of the tracking noise along each axis [m]."""
    snr_low: float = Field(1.0, gt=0)
    """Least signal-to-noise ratio asked of an effect: RMS of what it changes over the noise [1]."""
    snr_high: float = Field(6.0, gt=0)
    """Greatest; between them the logarithm is uniform [1]."""
    spacing: float = Field(3e-3, gt=0)
    """Edge of the finite elements [m]."""
    spacing_coarse: float = Field(4.5e-3, gt=0)
    """The same of the quick runs that find the magnitude [m]."""
    only: Annotated[list[str], Field(max_length=40)] = []
    """Names of effects that may be concealed; all if empty [name]."""
    faint: bool = False
    """Whether effects are concealed too that can hardly be seen at a tissue's magnitudes [1]."""


class Invent(Concealing):
    family: Literal["blocks", "tetrahedra", "springs", "lattice"] = "blocks"
    """What computes it: blocks of finite elements, with the choices below; or a family of surgisim/phantom/families,
    which draws all of them but `only` by itself [name]."""
    fps: float = Field(25.0, gt=0)
    """Frames per second [1/s]."""
    points: int = Field(200, ge=1)
    """Tracked points of the upper side [1]."""
    lag: float | None = Field(None, gt=0, le=0.02)
    """Viscosity over Young's modulus; drawn from 1 to 8 ms if null [s]."""
    close_phase: float = Field(0.0, ge=0, lt=1)
    """How long before its first active frame a grip closes, share of a frame [1]."""
    release_phase: float = Field(0.0, ge=0, lt=1)
    """How long after its last active frame a grip opens, share of a frame [1]."""
    plate: bool = True
    """Whether the recorded body stands on the plate that its base is stuck to [1]."""


class InventClip(Concealing):
    snr_low: float = Field(4.0, gt=0)
    """Least ratio of an effect to `noise` that is asked for; the tracks that a clip yields have their own [1]."""
    snr_high: float = Field(10.0, gt=0)
    """Greatest; between them the logarithm is uniform [1]."""
    spacing: float = Field(3.5e-3, gt=0)
    """Edge of the finite elements [m]."""
    spacing_coarse: float = Field(5e-3, gt=0)
    """The same of the quick runs that find the magnitude [m]."""
