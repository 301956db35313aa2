"""Settings of the summary."""

from typing import Any

from pydantic import Field

from surgisim.config.base import Settings


class Summary(Settings):
    """Nothing to choose: the summary shows every run that was asked for."""

    runs: dict[str, Any] = Field({})
    """Settings of each clip and variant, by 'CLIP, VARIANT' [object]."""
