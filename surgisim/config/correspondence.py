"""How the surface that frame 0 shows is followed."""

from typing import Annotated

from pydantic import Field

from surgisim.config.base import Settings


class Correspondence(Settings):
    margin: Annotated[float, Field(ge=0, le=0.2)] = 0.012
    """How far around an instrument motion is not believed, as a share of the longer image side [1]."""
