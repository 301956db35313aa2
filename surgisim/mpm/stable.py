"""The largest time step an explicit run may take."""

import math

from surgisim.physics.catalogue import Term
from surgisim.problem import Problem


def wave_speed(terms: dict[str, Term], values: dict[str, dict[str, float]], density: float) -> float:
    """Speed of the pressure wave at rest [m/s]: sqrt((lambda + 2 mu) / rho), summed over the laws."""
    modulus = sum(t.wave_modulus(**values[n]) for n, t in terms.items() if t.wave_modulus)
    return math.sqrt(modulus / density)


def largest_step(terms: dict[str, Term], values: dict[str, dict[str, float]], density: float, spacing: float) -> float:
    """Largest stable step [s]: 1 / (2 c / dx + 2 eta / (rho dx^2)).

    The wave speed alone is not enough once viscosity grows: the second part is the explicit limit of
    diffusion over one cell, halved as the first is.
    """
    viscosity = sum(t.viscosity(**values[n]) for n, t in terms.items() if t.viscosity)
    rate = 2 * wave_speed(terms, values, density) / spacing + 2 * viscosity / (density * spacing**2)
    return 1 / rate


def check_step(step: float, largest: float, where: str = "step") -> None:
    """Refuse a step that would blow up."""
    if step > largest * (1 + 1e-9):
        raise Problem(
            f"{where}: a step of {step:.3e} s is too large for this tissue's wave speed and viscosity; the largest "
            f"stable one is {largest:.3e} s. Take that, a coarser grid, or a softer tissue."
        )
