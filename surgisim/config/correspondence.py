"""How the surface that frame 0 shows is followed."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from surgisim.config.base import Settings


class Correspondence(Settings):
    margin: Annotated[float, Field(ge=0, le=0.2)] = 0.012
    """How far around an instrument motion is not believed, as a share of the longer image side [1]."""
    flow: str = "auto"
    """Optical flow: dis needs no weights; raft looks for the surface straight from frame 0 in every frame, too, at
    seconds a frame. A file of surgisim/perception/optical_flow; auto takes dis (docs/benchmarks/learned.md) [name]."""
    flow_weights: Path | None = None
    """raft: its weights, a safetensors file [path]."""
