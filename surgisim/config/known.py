"""Settings of the real recordings whose cause is known."""

from surgisim.config.base import Settings


class Known(Settings):
    case: str
    """Which recording: a file's name in surgisim/proof/known/ [name]."""
