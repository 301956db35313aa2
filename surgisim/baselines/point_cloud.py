"""Every particle of the thickened body is a mass; springs join those that lie near each other."""

import numpy as np
from scipy.spatial import cKDTree

from surgisim.artifacts.body import Body
from surgisim.baselines.springs import Network, joined

REACH = 1.8
"""How far springs reach [particle widths]: to the 26 neighbours of a cubic lattice."""


def network(body: Body, modulus: float) -> Network:
    """Springs whose directions are all alike stretch as tissue of this Young's modulus [Pa] and Poisson's ratio 1/4:
    mu = lambda = sum k L^2 / (15 V), so that sum k L^2 = 6 E V (Kot, Nagahashi and Szymczak, Elastic moduli of simple
    mass spring models, Visual Computer 31, 2015).

    Raises Problem where no two particles are near enough.
    """
    place, volume = body.rest.astype(float), body.volume.astype(float)
    near = cKDTree(place).query_pairs(REACH * float(np.cbrt(np.median(volume))), output_type="ndarray")
    pairs, stiffness = joined(place, near, body.torn, 6 * modulus * volume.sum(), "point_cloud")
    return Network(np.arange(len(place)), place, pairs, stiffness)
