"""Settings of the real recordings whose cause is known."""

from typing import Literal

from surgisim.config.base import Settings


class Known(Settings):
    case: str
    """Which recording: a file's name in surgisim/proof/known/ [name]."""
    part: Literal["recording", "hold_out", "bare"] = "recording"
    """What is diagnosed, what it is held against, or what tells its base [-]."""
