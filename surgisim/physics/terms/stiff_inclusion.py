"""A lump that is stiffer or softer than the tissue around it.

    sigma_elastic <- s(x) sigma_elastic,   s(x) = 1 + (s - 1) exp(-|x - c|^2 / (2 r^2))      [1]

s multiplies the stress of every law that stores energy, so that moduli scale and Poisson's ratio stays; viscosity
is left as it is. c and r are the law's place: centre and extent [m].
Eshelby, The determination of the elastic field of an ellipsoidal inclusion, and related problems, 1957, section 4.
"""

from typing import Any

import warp as wp

from surgisim.physics.catalogue import Param, Term


@wp.func
def factor(F: Any, q: Any, theta: Any):
    return theta[0]


def twin(F, q, s):
    return s


TERM = Term(
    factor=factor,
    twin=twin,
    stiffens=lambda s: s,
    place="somewhere",
    params={"s": Param("1", low=0.05, high=50.0, default=3.0, off=1.0)},
)
