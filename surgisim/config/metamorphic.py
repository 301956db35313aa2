"""Settings of the comparison of perturbed recordings' verdicts where nobody knows the cause."""

from surgisim.config.base import Settings


class Metamorphic(Settings):
    names: list[str]
    """Recordings, folders of their own [list of names]."""
    perturbations: list[str]
    """The recordings as they are first, then the perturbed ones, folders of each [list of names]."""
