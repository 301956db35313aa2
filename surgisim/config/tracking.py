"""How tissue points are followed, and what the instrument holds."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from surgisim.config.base import Settings


class Grasp(Settings):
    """One grip, as the user saw it."""

    pixel: tuple[float, float]
    """Middle of the gripped tissue in frame 0, x and y in the recording as it came [px]."""
    radius: Annotated[float, Field(gt=0)]
    """Radius of the gripped tissue, in the recording as it came [px]."""
    start: Annotated[float, Field(ge=0)] = 0.0
    """When it is taken hold of [s]."""
    end: Annotated[float, Field(gt=0)] | None = None
    """When it is let go; none is the end of the recording [s]."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.end is not None and self.end <= self.start:
            raise ValueError(f"it is let go at {self.end:g} s and taken hold of at {self.start:g} s; END must be later")
        return self


class Tracking(Settings):
    backend: Literal["flow_chain", "cotracker"] = "flow_chain"
    """A file of surgisim/perception/tracking [name]."""
    points: Annotated[int, Field(ge=10, le=20000)] = 500
    """Points spread over frame 0's tissue [points]."""
    points_near_grasp: Annotated[int, Field(ge=0, le=20000)] = 200
    """Further points close to what is grasped [points]."""
    patch: Annotated[float, Field(gt=0, le=0.2)] = 0.025
    """Half the side of the patch a point is recognised by, as a share of the longer image side [1]."""
    grasp: tuple[Grasp, ...] = ()
    """Grips given by the user; none lets them be found [list]."""
    find_grasp: bool = True
    """Whether to look for grips when none is given [yes or no]."""
    weights: Path | None = None
    """cotracker: the network as TorchScript (.pt) [path]."""
