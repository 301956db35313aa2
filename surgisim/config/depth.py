"""How far away the tissue is."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from surgisim.config.base import Settings


class Depth(Settings):
    backend: Literal["auto", "near_light", "given", "stereo", "depth_anything"] = "auto"
    """A file of surgisim/perception/depth; auto takes given depth, else a given right view, else near_light [name]."""
    distance: Annotated[float, Field(gt=0)] = 0.07
    """Median depth of frame 0, where the recording cannot tell the absolute size [m]."""
    relief: Annotated[float, Field(gt=0, le=1)] = 0.3
    """near_light: expected spread of depth in frame 0 about its mean slope, as a share of the distance [1]."""
    lattice: Annotated[int, Field(ge=16, le=320)] = 64
    """near_light: longer side of the grid that depth is solved on [px]."""
    range: Annotated[float, Field(gt=1)] = 2.0
    """depth_anything: farthest over nearest depth, which relative depth leaves open [1]."""
    weights: Path | None = None
    """depth_anything: folder with config.json and model.safetensors [path]."""
