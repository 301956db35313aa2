"""Settings of the comparison of perturbed recordings' verdicts."""

from surgisim.config.base import Settings


class Robustness(Settings):
    bodies: list[int]
    """Cases, folders of their own [1]."""
    perturbations: list[str]
    """The recordings as they are first, then the perturbed ones, folders of each body [list of names]."""
