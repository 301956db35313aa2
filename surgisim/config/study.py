"""Settings of the preference study."""

from pydantic import Field

from surgisim.config.base import Settings

PARTS = {
    "methods": ("main", "elastic_default", "point_cloud", "mesh"),
    "parameters": ("main", "no_estimation"),
}
"""Part of the study -> variants that are shown beside each other."""


class Study(Settings):
    clips: list[str] = Field([])
    """Names of the clips whose frames are passed, in their order [list of names]."""
    films: list[tuple[str, str]] = Field([])
    """Clip and variant of each film that is passed, in their order [list of pairs of names]."""
    seed: int = Field(0)
    """Where a page that is opened without a number of its own begins to shuffle; it also makes films' names, which say
    nothing of what they show [1]."""
