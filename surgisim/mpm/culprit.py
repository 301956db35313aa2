"""Which law pushed hardest where a run broke down."""

from typing import TYPE_CHECKING

import numpy as np

from surgisim.physics.catalogue import choose, defaults

if TYPE_CHECKING:
    from surgisim.mpm.simulator import Simulator, State


def culprit(simulator: "Simulator", theta: np.ndarray, state: "State", particle: int) -> str:
    """The law whose stress is largest (or no number) at a particle, a step before it broke down."""
    u, v, q = state
    index, link = simulator.links(simulator.rest[particle : particle + 1])
    slope = link[0, :, 1:]
    F = np.eye(3) + np.einsum("ka,kb->ab", u[index[0]].astype(float), slope)
    L = np.einsum("ka,kb->ab", v[index[0]].astype(float), slope) @ np.linalg.inv(F)
    D = 0.5 * (L + L.T)
    sizes, column, cell = {}, 0, 0
    for name, term in choose(simulator.terms).items():
        names = list(term.row(defaults(term)))
        mine = theta[particle, column : column + len(names)]
        own = q[particle, cell : cell + term.memory].astype(float)
        column, cell = column + len(names), cell + term.memory
        if term.stress is not None:
            size = np.abs(term.cauchy(F, D, own, 0.0, dict(zip(names, mine, strict=True)))).max()
            sizes[name] = size if np.isfinite(size) else np.inf
    return max(sizes, key=sizes.get) if sizes else "no law"
