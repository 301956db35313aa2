"""Plastic set: tissue stretched beyond its yield strain does not come back all the way.

    F_e = F exp(-p),   e = dev (C_e - I) (C_e + I)^-1,   C_e = F_e^T F_e
    alpha >= share <|e| + alpha - yield_strain>,   p grows along e by what alpha grows

p (symmetric, without trace) is the logarithmic strain that stays, in tissue's own frame; alpha how much of it was ever
made; |e| von Mises' equivalent strain. Laws that store energy see F_e, so the set has their volume and turns with
the tissue. In one long pull the share `share` of the strain beyond the yield strain stays: 1 is perfect plasticity, below
it tissue hardens, and at 0 nothing ever stays. The exponential makes det F_e = det F. For isotropic laws stress : e >= 0,
so every growth of p loses energy. <x> = x^3 / (x^2 + .02^2) for x > 0: yield is soft over two per cent of strain; one kink
remains, where a load turns, as in everything that keeps its largest value.
Weber and Anand, Finite deformation constitutive equations and a time integration procedure for isotropic,
hyperelastic-viscoplastic solids (1990); Miehe, Apel and Lambrecht, Anisotropic additive plasticity in the logarithmic
strain space (2002), for the additive p.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.strain import (
    SMALL, exponential, packed, ramp, size, strain,
    twin_exponential, twin_packed, twin_ramp, twin_size, twin_strain, twin_unpacked, unpacked,
)  # fmt: skip

SOFT = 0.02
"""Strain over which yield sets in."""


@wp.func
def flow(q: Any, theta: Any):
    return exponential(-unpacked(q))


@wp.func
def advance(F: Any, D: Any, R: Any, u: Any, q: Any, theta: Any, dt: Any):
    e = strain(F * exponential(-unpacked(q)))
    much, alpha, zero = size(e), q[5], F.dtype(0.0)
    more = wp.max(theta[1] * ramp(much + alpha - theta[0], F.dtype(SOFT)) - alpha, zero)
    step = (more / (much + F.dtype(SMALL))) * packed(e)
    return q + wp.vector(step[0], step[1], step[2], step[3], step[4], more, dtype=F.dtype)


def twin(q, yield_strain, share):
    return twin_exponential(-twin_unpacked(q))


def twin_advance(F, D, u, q, dt, yield_strain, share):
    e = twin_strain(F @ twin_exponential(-twin_unpacked(q)))
    much, alpha = twin_size(e), q[..., 5]
    more = np.maximum(share * twin_ramp(much + alpha - yield_strain, SOFT) - alpha, 0)
    step = (more / (much + SMALL))[..., None] * twin_packed(e)
    return q + np.concatenate([step, more[..., None]], -1)


TERM = Term(
    flow=flow,
    advance=advance,
    memory=6,
    twin=twin,
    twin_advance=twin_advance,
    params={
        "yield_strain": Param("1", low=0.02, high=1.0, default=0.15),
        "share": Param("1", low=0.0, high=0.95, default=0.4, off=0.0, logarithmic=False),
    },
)
