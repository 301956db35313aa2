"""Newtonian viscosity: resists how fast it deforms and remembers nothing.

    sigma = 2 eta D                                                   [Pa]

Beside an elastic law it makes a Kelvin-Voigt solid.
Landau and Lifshitz, Fluid Mechanics, 2nd ed. (1987), section 15.
"""

from typing import Any

import warp as wp

from surgisim.physics.catalogue import Param, Term


@wp.func
def stress(F: Any, D: Any, theta: Any):
    return (F.dtype(2.0) * theta[0]) * D


def twin(F, D, eta):
    return 2 * eta * D


TERM = Term(
    stress=stress,
    twin=twin,
    viscosity=lambda eta: eta,
    params={"eta": Param("Pa s", low=1e-2, high=1e3, default=2.0, off=0.0)},
)
