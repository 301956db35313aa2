"""Settings of the summary."""

from surgisim.config.base import Settings


class Summary(Settings):
    """Nothing to choose: the summary shows every run that was asked for."""
