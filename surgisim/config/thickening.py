"""Settings of the thick body."""

from typing import Literal

from pydantic import Field

from surgisim.config.base import Settings


class Thickening(Settings):
    method: Literal["behind", "literal"] = "behind"
    """'behind' puts material behind the seen surface, 'literal' is the paper's Algorithm 1 as printed [-]."""
    cells: int = Field(12, ge=3)
    """Grid cells along the longest side of the seen surface [1]."""
    per_cell: float = Field(8.0, gt=0)
    """Particles in a grid cell [1/cell]."""
    most_particles: int = Field(12000, ge=100)
    """Where there would be more, the grid is made coarser [1]."""
    back: float = Field(1.25, gt=1)
    """The body ends at this multiple of the surface's largest depth [z_max]."""
    thickness: float | None = Field(None, gt=0)
    """Thickness behind the surface instead of a flat back [thickness_unit]."""
    thickness_unit: Literal["m", "longest side"] = "m"
    """What `thickness` is measured in: metres, or the longest side of the seen surface [-]."""
    held_rear: int = Field(1, ge=0)
    """Particle layers at the back that do not move, half a grid cell each [1]."""
    held_border: int = Field(2, ge=0)
    """Particle columns along the border of what is seen that do not move, half a grid cell each; 0 leaves it free
    [1]."""
    smooth: float = Field(0.03, ge=0, le=0.5)
    """Width of the median filter over the surface's depth [longest image side]."""
    least_cover: float = Field(0.5, gt=0, lt=1)
    """Opacity from which a pixel counts as covered by the scene [1]."""
    seed: int = 0
    """Seed of the printed algorithm's random numbers [1]."""
