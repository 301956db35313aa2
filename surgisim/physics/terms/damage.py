"""Damage: tissue that was stretched too far is softer from then on.

    factor = 1 - most (1 - exp(-rate <k - onset>)),   k = the largest |e| so far,   e = dev (C - I) (C + I)^-1

|e| is von Mises' equivalent strain and `onset` the strain from which damage begins. The factor multiplies the stress
of every law that stores energy; the damage 1 - factor never heals and never reaches `most`. With psi that energy, the
power lost is -d(factor)/dt psi >= 0. k does not depend on `rate`, so the misfit's slope at rate = 0 already tells
whether and where damage pays. <x> = x^3 / (x^2 + .02^2) for x > 0; one kink remains, where a load turns, as in
everything that keeps its largest value.
Simo, On a fully three-dimensional finite-strain viscoelastic damage model, CMAME 60 (1987), with strain in place of
the energy norm, so that laws need not see one another.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.strain import ramp, size, strain, twin_ramp, twin_size, twin_strain

SOFT = 0.02
"""Strain over which damage sets in."""


@wp.func
def factor(F: Any, q: Any, theta: Any):
    one = F.dtype(1.0)
    return one - theta[2] * (one - wp.exp(-theta[1] * ramp(q[0] - theta[0], F.dtype(SOFT))))


@wp.func
def advance(F: Any, D: Any, R: Any, u: Any, q: Any, theta: Any, dt: Any):
    return wp.vector(wp.max(q[0], size(strain(F))), length=1, dtype=F.dtype)


def twin(F, q, onset, rate, most):
    return 1 + most * np.expm1(-rate * twin_ramp(q[..., 0] - onset, SOFT))


def twin_advance(F, D, u, q, dt, onset, rate, most):
    return np.maximum(q, twin_size(twin_strain(F))[..., None])


TERM = Term(
    factor=factor,
    advance=advance,
    memory=1,
    twin=twin,
    twin_advance=twin_advance,
    params={
        "onset": Param("1", low=0.02, high=1.0, default=0.15),
        "rate": Param("1", low=0.1, high=2e1, default=2.0, off=0.0),
        "most": Param("1", low=0.05, high=1.0, default=1.0, logarithmic=False),
    },
)
