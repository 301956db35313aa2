"""What the light that tissue sends back says of how it turns and comes nearer.

The lamp rides on the camera. A matte surface at distance d whose normal makes the angle theta with the view sends back
albedo cos(theta) / d^2 (the headlight that depth is read from, see perception/depth/near_light.py). Its albedo travels
with the tissue, so the change of log brightness along a tracked point's way is that of log cos(theta) - 2 log d: how
the simulated surface must turn and approach, where tracks say only how it moves across the view. On invented clips
the turning is by far the larger part (.13 to .38 against .03, root mean square over moving tissue of two clips).

Not known are how matte the tissue is (light that scatters inside it and comes back from walls depends less on the
angle), how the surface leant at rest, which its depth tells only roughly, and the error of the simulated shape. Each
is linear to first order and is integrated out, as the error of the simulation is for the tracks (model_error.py).
"""

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from surgisim.estimation.whiten import inverse_root
from surgisim.lighting.headlight import MATTE, facing
from surgisim.mpm.simulator import Simulator

MATTE_SPREAD = 0.25
"""Spread of how far brightness follows the angle, about what is expected of it."""
LEANING = 0.15
"""Spread of the slope of the whole surface at rest, each way, where its depth is guessed."""
AROUND = 12
"""Neighbours that a point's surface at rest is fitted to."""
GRAZING = 0.05
"""Least cosine: a surface seen edge-on is lit by what is around it."""


def headlight(rest: np.ndarray, normal: np.ndarray, moved: np.ndarray, turned: np.ndarray) -> tuple[np.ndarray, ...]:
    """Change of log brightness by turning, log cos(theta), and by coming nearer, -2 log d, (...) each.

    rest, moved: surface points, camera frame [m], (..., 3); normal, turned: their normals out of the tissue, of any
    length, (..., 3).
    """
    before, after = (np.log(np.maximum(facing(at, n), GRAZING)) for at, n in ((rest, normal), (moved, turned)))
    nearer = 2 * (np.log(np.linalg.norm(rest, axis=-1)) - np.log(np.linalg.norm(moved, axis=-1)))
    return after - before, nearer


@dataclass(frozen=True)
class Brightness:
    """Changes of log brightness of K surface points since frame 0, to compare simulations with."""

    rest: np.ndarray
    """Their places in frame 0, camera frame [m], (K, 3)."""
    tangents: np.ndarray
    """Two directions along the surface there, (K, 2, 3)."""
    seen: np.ndarray
    """Change of log brightness since frame 0, that of still tissue taken off, (K, T), zero where not seen."""
    weight: np.ndarray
    """1 / standard deviation, (K, T), zero where not seen."""
    modes: np.ndarray
    """Of the simulation's own error times their standard deviations, (K, Q)."""
    course: np.ndarray
    """Share of the pull in every frame, (T,)."""
    step: float
    """Over how far a surface's turning is taken [m]."""
    independent: float
    """Share of the numbers that counts as independent."""
    carry: sparse.csr_matrix
    """Active nodes to the points and to four places around each, (5 K, A)."""
    kept: dict = field(default_factory=dict, init=False, compare=False, repr=False)
    """What is computed once for the frames that are looked at."""

    def carried_by(self, simulator: Simulator) -> Self:
        """The same points on another grid."""
        return replace(self, carry=carry_of(simulator, self.rest, self.tangents, self.step))

    def placed(self, rest: np.ndarray) -> Self:
        """The same points where they lie otherwise, (K, 3) [m]."""
        return replace(self, rest=rest, tangents=tangents_of(rest))

    def residual(self, u: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Weighted difference, simulated minus seen, of what is left to tell at `frames`, (K, len(frames)).

        u: nodal displacements [m], (T, A, 3).
        """
        turning, nearer, across, down = self._changes(u, frames)
        weight = self.weight[:, frames]
        r = weight * (MATTE * turning + nearer - self.seen[:, frames])
        columns = np.stack([MATTE_SPREAD * turning, LEANING * across, LEANING * down], -1)
        columns *= np.sqrt(self.independent) * weight[..., None]
        return _whitened(r, columns, self.modes, *self._modes_of(frames))

    def _modes_of(self, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The modes' size at `frames`, (K, F), and their inner inverse root, (Q, Q), computed once."""
        key = frames.tobytes()
        if key not in self.kept:
            size = np.sqrt(self.independent) * self.weight[:, frames] * np.abs(self.course[frames])
            gram = (self.modes * (size**2).sum(1)[:, None]).T @ self.modes
            self.kept[key] = size, inverse_root(gram)
        return self.kept[key]

    def _changes(self, u: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, ...]:
        """By turning and by coming nearer, and what turning changes by for a unit of slope at rest, (K, F) each."""
        count = len(self.rest)
        moved = np.stack([self.carry @ u[t].astype(float) for t in frames], 1).reshape(count, 5, len(frames), 3)
        at = self.rest[:, None] + moved[:, 0]
        slopes = np.stack([moved[:, 1] - moved[:, 2], moved[:, 3] - moved[:, 4]], 1) / (2 * self.step)

        def of(tangents: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            turned = np.cross(tangents[:, 1, None] + slopes[:, 1], tangents[:, 0, None] + slopes[:, 0])
            return headlight(self.rest[:, None], np.cross(tangents[:, 1], tangents[:, 0])[:, None], at, turned)

        turning, nearer = of(self.tangents)
        leant = []
        for axis in range(2):
            # Tissue that leans one unit more: what was one unit along this axis lies that much farther off.
            slope = 0.05
            along = self.tangents[..., axis]
            shifted = self.tangents.copy()
            shifted[..., 2] += slope * along
            leant.append((of(shifted)[0] - turning) / slope)
        return turning, nearer, *leant


def _whitened(r: np.ndarray, columns: np.ndarray, modes: np.ndarray, size: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Of r, (K, F), what is left to tell: its squares are r^T (1 + B B^T + C C^T)^(-1) r.

    B is every mode (K, Q) times `size` (K, F), C `columns` (K, F, C); inner: `inverse_root` of B^T B, (Q, Q). The modes
    go first, as they are the same for every simulation: what hangs on one is a matrix of C x C.
    """
    both = np.concatenate([r[..., None], columns], -1)
    told = modes.T @ np.einsum("kf,kfc->kc", size, both)
    both = both - size[..., None] * (modes @ (inner @ told))[:, None]
    r, columns = both[..., 0], both[..., 1:]
    taken = inverse_root(np.einsum("kfc,kfd->cd", columns, columns)) @ np.einsum("kfc,kf->c", columns, r)
    return r - columns @ taken


def tangents_of(rest: np.ndarray) -> np.ndarray:
    """Along the surface at each point, across the view and down it, (K, 2, 3), each of length 1, from a plane through
    its neighbours."""
    near = cKDTree(rest).query(rest, min(AROUND, len(rest)))[1]
    around = rest[near]
    flat = np.concatenate([around[..., :2] - rest[:, None, :2], np.ones((*near.shape, 1))], -1)
    gram = np.swapaxes(flat, 1, 2) @ flat + 1e-18 * np.eye(3)
    slope = np.linalg.solve(gram, np.swapaxes(flat, 1, 2) @ around[..., 2:])[:, :2, 0]
    one, zero = np.ones(len(rest)), np.zeros(len(rest))
    right, down = np.stack([one, zero, slope[:, 0]], -1), np.stack([zero, one, slope[:, 1]], -1)
    both = np.stack([right, down], 1)
    # Beside a fold a slope has no bound, but places along it must not leave the tissue.
    return both / np.linalg.norm(both, axis=-1, keepdims=True)


def carry_of(simulator: Simulator, rest: np.ndarray, tangents: np.ndarray, step: float) -> sparse.csr_matrix:
    sides = [np.zeros_like(rest)]
    for axis in range(2):
        sides += [step * tangents[:, axis], -step * tangents[:, axis]]
    points = rest[:, None] + np.stack(sides, 1)
    return simulator.carry(points.reshape(-1, 3)).tocsr()
