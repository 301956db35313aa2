"""Settings of the small pictures of a run, and of the gallery that shows several."""

from pydantic import Field, PositiveInt

from surgisim.config.base import Settings


class Pictures(Settings):
    moving_bytes: PositiveInt = Field(1_000_000)
    """Most that the moving picture may take [bytes]."""
    still_bytes: PositiveInt = Field(200_000)
    """Most that one still picture may take [bytes]."""


class Gallery(Settings):
    clips: list[str] = Field([])
    """Names of the runs whose pictures are passed, in their order [list of names]."""
    most_bytes: PositiveInt = Field(8_000_000)
    """Most that the page may take [bytes]."""
