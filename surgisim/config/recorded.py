"""Settings of a clip that is put into a recording folder."""

from surgisim.config.base import Settings


class Recorded(Settings):
    name: str
    """What the recording is called [name]."""
