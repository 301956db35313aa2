"""Settings of the scoreboard."""

from surgisim.config.base import Settings


class Scoreboard(Settings):
    pages: str = ""
    """Where a case's own page lies from the scoreboard, with {seed} and {case} in it; none if empty [path]."""
    seals: int = 0
    """How many seals were written before the first diagnosis [1]."""
