"""From a monocular surgical video to a simulation with the tissue's own physics."""

__version__ = "0.1.0"
