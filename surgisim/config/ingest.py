"""How a recording is read and brought to its working size."""

from typing import Annotated, Literal

from pydantic import Field

from surgisim.config.base import Settings


class Ingest(Settings):
    size: Annotated[int, Field(ge=32)] = 320
    """Longest side of the frames that are worked on; a smaller recording is not enlarged [px]."""
    fps: Annotated[float, Field(gt=0)] | None = None
    """Frames per second; null takes the container's, and 25 for a folder of images [1/s]."""
    focal: Annotated[float, Field(gt=0)] | None = None
    """Focal length in the recording before cropping and resizing; null takes the one that came with the
    recording, or assumes 0.9 times the longest side [px]."""
    principal: tuple[float, float] | None = None
    """Where the optical axis meets the recording before cropping and resizing, x then y; null is the middle [px]."""
    start: Annotated[float, Field(ge=0)] = 0.0
    """Where in the recording to begin [s]."""
    end: Annotated[float, Field(gt=0)] | None = None
    """Where in the recording to end; null is its end [s]."""
    max_frames: Annotated[int, Field(ge=2)] = 400
    """Frames kept at most, from the beginning [frames]."""
    crop: Literal["auto", "none"] | tuple[int, int, int, int] = "auto"
    """What to keep: auto cuts black borders off, or left, top, width, height in the recording [px]."""
    drop_duplicates: bool = True
    """Whether frames that a container shows several times are kept once, and the fps corrected [yes/no]."""
    every: Annotated[int, Field(ge=3)] = 8
    """One frame in this many is held out between used ones [frames]."""
    first: Annotated[int, Field(ge=1)] = 1
    """The first frame held out between used ones [frame]."""
    tail: Annotated[float, Field(ge=0, lt=0.9)] = 0.15
    """Share of the frames held out at the end [1]."""
    given_masks: Literal["auto", "gt_masks", "masks", "none"] = "auto"
    """Which of the masks that came with the recording to take; auto prefers gt_masks, the tool alone [name]."""
    masks_show: Literal["tool", "tissue"] = "tool"
    """What white means in the masks that came with the recording [name]."""
    depth_unit: Annotated[float, Field(gt=0)] = 1e-3
    """Length of one step of the depth images that came with the recording [m]."""
    baseline: Annotated[float, Field(ge=0)] = 0.0
    """Distance between the two views where a right one came with the recording; 0 is not known [m]."""
    max_pixels: Annotated[int, Field(ge=1024)] = 64_000_000
    """Largest image that is decoded, width times height [px]."""
    max_unpacked: Annotated[int, Field(ge=1)] = 8 * 1024**3
    """Largest sum of unpacked sizes accepted in an archive [bytes]."""
