"""Points that move with a body."""

import numpy as np
from scipy.sparse import csr_matrix

from surgisim.mpm.nodes import Nodes


class Carried:
    """Rest points that hang on a body: on its grid's splines, and on the kinks at the skin of what is gripped."""

    def __init__(self, rest: np.ndarray, simulator: Nodes) -> None:
        self.rest = np.asarray(rest, float)
        index, link = simulator.links(self.rest)
        count, nodes = index.shape
        weights = np.moveaxis(np.asarray(link, float), -1, 0).ravel()
        ends = np.arange(4 * count + 1) * nodes
        # Rows: every point's displacement, then its slopes along x, y and z.
        self.matrix = csr_matrix((weights, np.tile(index.ravel(), 4), ends), (4 * count, len(simulator.place)))

    def at(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions [m], (Q, 3), and deformation gradients (Q, 3, 3) at solid nodes' displacements u [m], (A, 3)."""
        moved, *slopes = (self.matrix @ np.asarray(u, float)).reshape(4, len(self.rest), 3)
        return self.rest + moved, np.eye(3) + np.stack(slopes, -1)
