"""Energy of a vibrating rod."""

import numpy as np

from surgisim.physics.catalogue import choose
from surgisim.verification.rod import Rod


def stored(rod: Rod, u: np.ndarray) -> np.ndarray:
    """Elastic energy [J] of nodal displacements [m], (T, A, 3), (T,); in float64, from the laws' own energies."""
    simulator, body = rod.made.simulator, rod.made.body
    index, link = simulator.links(body.rest.astype(float))
    laws = {name: term.energy for name, term in choose(rod.values).items() if term.energy}
    total = np.zeros(len(u))
    for t, state in enumerate(u.astype(float)):
        F = np.eye(3) + np.einsum("pka,pkb->pab", state[index], link[..., 1:])
        total[t] = sum(np.sum(body.volume * energy(F, **rod.values[name])) for name, energy in laws.items())
    return total


def kinetic(rod: Rod, v: np.ndarray, later: np.ndarray | None = None) -> np.ndarray:
    """Kinetic energy [J] of nodal velocities [m/s], (T, A, 3), (T,).

    later: the velocities one step on. Symplectic Euler's velocity belongs half a step before its displacement; the
    product of two neighbouring ones belongs to the displacement's own time, and with it the energy of a linear
    body is kept exactly and not only to first order.
    """
    later = v if later is None else later
    return np.einsum("tna,tna,n->t", v.astype(float), later.astype(float), rod.mass) / 2
