"""Settings of shortening."""

from typing import Literal

from surgisim.config.base import Settings


class Shorten(Settings):
    end: Literal["load", "hold"] = "hold"
    """Last phase of the first grasp that may be fitted [name]."""
