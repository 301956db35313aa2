"""Settings of the comparison across families of generators."""

from pydantic import Field

from surgisim.config.base import Settings


class Across(Settings):
    families: list[str] = Field([])
    """Names of the families whose boards are passed, in their order [list of names]."""
