"""How the instrument is told from the tissue."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from surgisim.config.base import Settings


class Click(Settings):
    """A point the user marked."""

    frame: Annotated[int, Field(ge=0)]
    """Which frame it was marked in, of those that the clip is read at [frame]."""
    x: float
    """To the right, in the recording as it came [px]."""
    y: float
    """Down, in the recording as it came [px]."""
    label: Literal["tool", "tissue"] = "tool"
    """What is there [name]."""


class Masking(Settings):
    backend: str = "auto"
    """auto takes masks that came with the recording; else sam2 where an instrument is clicked and its two files are
    there, which draws closer outlines then (docs/benchmarks/learned.md); else colour_motion. Or a file of
    surgisim/perception/masking: colour_motion, given, sam2 [name]."""
    clicks: list[Click] = []
    """Points the user marked as tool or tissue; sam2 follows what is marked once for each instrument, in any frame
    [list]."""
    require_tool: bool = False
    """Whether a clip in which no instrument is found is refused [yes/no]."""
    margin: Annotated[int, Field(ge=0)] | None = None
    """How far around the instrument the tissue is left out too, because its outline mixes both; null is 0.6 % of
    the longest side [px]."""
    refine: bool = False
    """Whether the outline is drawn to the nearest edge by GrabCut [yes/no]."""
    encoder: Path | None = None
    """SAM 2's image encoder for the backend sam2, an ONNX file [path]."""
    decoder: Path | None = None
    """SAM 2's mask decoder for the backend sam2, an ONNX file [path]."""
