"""A second relaxation beside the first, slower: what still creeps when the fast branch has come to rest.

The law is `relaxation`'s, with G [Pa] and tau [s] of its own. Two branches follow most soft tissues over the decades
of time that one clip holds.
Fung, Biomechanics: Mechanical Properties of Living Tissues, 2nd ed. (1993), section 7.6.
"""

from dataclasses import replace

from surgisim.physics.catalogue import Param
from surgisim.physics.terms import relaxation

TERM = replace(
    relaxation.TERM,
    params={
        "G": Param("Pa", low=1e1, high=1e5, default=5e2, off=0.0),
        "tau": Param("s", low=1.0, high=2e2, default=5.0),
    },
)
