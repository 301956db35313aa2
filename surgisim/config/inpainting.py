"""How the tissue behind the instrument is filled in."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from surgisim.config.base import Settings


class Inpainting(Settings):
    backend: str = "flow_copy"
    """A file of surgisim/perception/inpainting: flow_copy, or network for what no frame saw [name]."""
    margin: Annotated[int, Field(ge=0)] | None = None
    """How far around the instrument is filled in too, because its outline, blur and shadow mix both; null is 1.6 %
    of the longest side [px]."""
    reach: Annotated[int, Field(ge=1)] = 400
    """Farthest frame a pixel may be copied from [frames]."""
    flow: str = "auto"
    """Optical flow by which frames are followed: dis needs no weights. A file of surgisim/perception/optical_flow;
    auto takes dis (docs/benchmarks/learned.md) [name]."""
    flow_weights: Path | None = None
    """raft: its weights, a safetensors file [path]."""
    weights: Path | None = None
    """The network for the backend network, TorchScript (.pt) or ONNX (.onnx) [path]."""
