"""Settings of the paper's tables."""

from typing import Any

from pydantic import Field

from surgisim.config.base import Settings


class Tables(Settings):
    clips: list[str] = []
    """Names of the clips whose recordings are passed, in their order [list of names]."""
    receipt: dict[str, Any] = Field({})
    """What goes into the receipt beside the recordings: digests of the stages' code, and the settings of each clip
    [object]."""
