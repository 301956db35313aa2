"""Plastic set: tissue stretched beyond its yield strain does not come back all the way.

    F_e = F exp(-share p),   e = dev (C - I) (C + I)^-1,   C = F^T F
    k = the largest |e| so far,   dp = e / |e| d<k - yield_strain>

p (symmetric, without trace) is all the strain there ever was beyond the yield strain |e| = yield_strain, in
tissue's own frame, each part along the strain that made it; |e| is von Mises' equivalent strain. The share `share`
of p stays, as a logarithmic strain: laws that store energy see F_e. 1 is perfect plasticity, below it tissue
hardens (in any proportional load this is the return map with linear hardening (1 - share) / share), at 0 all comes
back. Repeating a load adds nothing. The exponential keeps det F_e = det F. As |p| <= |e| - yield_strain wherever p
grows, e : (e - share p) > 0 there: in isotropic tissue the set costs energy and never gives any. p does not depend
on `share`, so the misfit's slope at share = 0 already tells whether and where a set pays. <x> = x^3 / (x^2 + .02^2)
for x > 0: yield is soft over two per cent of strain; one kink remains, where a load turns, as in everything that
keeps its largest value.
Dorfmann and Ogden, A constitutive model for the Mullins effect with permanent set in particle-reinforced rubber,
IJSS 41 (2004), for a set that follows the largest load; Weber and Anand, Finite deformation constitutive equations
and a time integration procedure for isotropic, hyperelastic-viscoplastic solids, CMAME 79 (1990), for the
exponential.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.strain import (
    SMALL,
    exponential,
    packed,
    ramp,
    size,
    strain,
    twin_exponential,
    twin_packed,
    twin_ramp,
    twin_size,
    twin_strain,
    twin_unpacked,
    unpacked,
)

SOFT = 0.02
"""Strain over which yield sets in."""


@wp.func
def flow(q: Any, theta: Any):
    return exponential(-theta[1] * unpacked(q))


@wp.func
def advance(F: Any, D: Any, R: Any, u: Any, q: Any, theta: Any, dt: Any):
    e = strain(F)
    largest = wp.max(q[5], size(e))
    soft = F.dtype(SOFT)
    more = ramp(largest - theta[0], soft) - ramp(q[5] - theta[0], soft)
    p = (more / (size(e) + F.dtype(SMALL))) * packed(e)
    return q + wp.vector(p[0], p[1], p[2], p[3], p[4], largest - q[5], dtype=F.dtype)


def twin(q, yield_strain, share):
    return twin_exponential(-share * twin_unpacked(q))


def twin_advance(F, D, u, q, dt, yield_strain, share):
    e, before = twin_strain(F), q[..., 5]
    largest = np.maximum(before, twin_size(e))
    more = twin_ramp(largest - yield_strain, SOFT) - twin_ramp(before - yield_strain, SOFT)
    p = q[..., :5] + (more / (twin_size(e) + SMALL))[..., None] * twin_packed(e)
    return np.concatenate([p, largest[..., None]], -1)


TERM = Term(
    flow=flow,
    advance=advance,
    memory=6,
    twin=twin,
    twin_advance=twin_advance,
    params={
        "yield_strain": Param("1", low=0.02, high=1.0, default=0.15),
        "share": Param("1", low=0.0, high=1.0, default=0.4, off=0.0, logarithmic=False),
    },
)
