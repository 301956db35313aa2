"""Settings of a perturbation."""

from pydantic import Field

from surgisim.config.base import Settings


class Perturb(Settings):
    name: str
    """Which, of surgisim/proof/perturb/catalogue.py [name]."""
    seed: int = Field(0, ge=0)
    """Of what is drawn [1]."""
