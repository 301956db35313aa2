"""Settings of the comparison of ways to diagnose."""

from surgisim.config.base import Settings


class Ablations(Settings):
    ways: list[str]
    """What each scoreboard's way is called, the method first [list of names]."""
