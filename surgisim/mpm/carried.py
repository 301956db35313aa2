"""Points that move with a body."""

import numpy as np

from surgisim.mpm.nodes import Nodes


class Carried:
    """Rest points that hang on a body: on its grid's splines, and on the kinks at the skin of what is gripped."""

    def __init__(self, rest: np.ndarray, simulator: Nodes) -> None:
        self.rest = np.asarray(rest, float)
        self.index, self.link = simulator.links(self.rest)

    def at(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions [m], (Q, 3), and deformation gradients (Q, 3, 3) at solid nodes' displacements u [m], (A, 3)."""
        here = u[self.index].astype(float)
        moved = self.rest + np.einsum("qk,qka->qa", self.link[..., 0], here)
        return moved, np.eye(3) + np.einsum("qka,qkb->qab", here, self.link[..., 1:])
