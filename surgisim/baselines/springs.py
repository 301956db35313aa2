"""Masses joined by springs, carried by the same grips and held in the same places as the method's body.

    m_i a_i = sum_j k_ij (|d_ij| - L_ij + b d/dt |d_ij|) d_ij / |d_ij|,    d_ij = x_j - x_i

stepped by symplectic Euler, as in the examples of Taichi (Hu et al., ACM Trans. Graph. 38, 2019) on which the paper's
comparison is built. b is a time: how viscous springs are beside their stiffness.
What an anchor holds goes exactly where it goes.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from scipy import sparse
from scipy.spatial import cKDTree

from surgisim.mpm.grip import Drive
from surgisim.mpm.tear import Tear
from surgisim.problem import Problem

SAFETY = 0.9
"""Share of the largest stable step that is used."""
HELD = 0.5
"""Share of a particle's volume from which on an anchor holds all of it."""

NEAR = 6
"""Masses that carry what is none."""


@dataclass(frozen=True)
class Network:
    """V masses and S springs."""

    vertices: np.ndarray
    """Particles of the body that are masses, (V,) int."""
    place: np.ndarray
    """Where they rest, camera frame [m], (V, 3)."""
    pairs: np.ndarray
    """Ends of each spring, numbers of masses, (S, 2) int."""
    stiffness: np.ndarray
    """[N/m], (S,)."""

    @property
    def length(self) -> np.ndarray:
        """At rest [m], (S,)."""
        return np.linalg.norm(np.diff(self.place[self.pairs], axis=1)[:, 0], axis=1)

    def energy(self, u: np.ndarray) -> float:
        """What the springs hold at displacements u [m], (V, 3) [J]."""
        stretched = np.linalg.norm(np.diff((self.place + u)[self.pairs], axis=1)[:, 0], axis=1) - self.length
        return 0.5 * float((self.stiffness * stretched**2).sum())


@dataclass(frozen=True)
class Swing:
    """What the masses did, frame by frame."""

    u: np.ndarray
    """Displacement [m], (T, V, 3)."""
    v: np.ndarray
    """Velocity [m/s], (T, V, 3)."""
    energy: np.ndarray
    """Kinetic and elastic [J], (T, 2)."""


def joined(place: np.ndarray, pairs: np.ndarray, torn: np.ndarray, total: float, where: str) -> tuple:
    """Springs between these pairs that cross no tear, and their stiffness [N/m], so that sum k L^2 is `total` [J].

    Raises Problem where none is left.
    """
    if len(torn):
        across = Tear(torn).crosses(place[pairs[:, 0]], place[pairs[:, 1]])
        pairs = pairs[~across]
    if not len(pairs):
        raise Problem(f"baseline {where}: no two of {len(place)} particles are near enough for a spring.")
    length = np.linalg.norm(np.diff(place[pairs], axis=1)[:, 0], axis=1)
    return pairs, total / len(pairs) / length**2


def masses(net: Network, rest: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Mass of each of the network's [kg], (V,): that of the particles, (P, 3) [m] and (P,), goes to the nearest."""
    nearest = cKDTree(net.place).query(rest)[1]
    return np.bincount(nearest, mass, len(net.place))


def spread(net: Network, rest: np.ndarray) -> sparse.csr_matrix:
    """What carries particles [m], (P, 3), along with the masses, (P, V): the masses themselves, and others as those
    beside them go, the nearer the more."""
    far, near = cKDTree(net.place).query(rest, k=min(NEAR, len(net.place)))
    far, near = far.reshape(len(rest), -1), near.reshape(len(rest), -1)
    share = 1 / np.maximum(far, 1e-6 * net.length.min()) ** 2
    share /= share.sum(1, keepdims=True)
    rows = np.repeat(np.arange(len(rest)), near.shape[1])
    return sparse.csr_matrix((share.ravel(), (rows, near.ravel())), (len(rest), len(net.place)))


def stable_step(net: Network, mass: np.ndarray, lag: float) -> float:
    """Largest step that is surely stable [s]; lag: b [s].

    By Gershgorin's bound on the highest frequency w, and Belytschko, Liu, Moran and Elkhodary, Nonlinear finite
    elements, 2nd ed. (2014), section 6.2: 2 / w (sqrt(1 + z^2) - z) with z = b w / 2.
    """
    load = np.bincount(net.pairs.ravel(), np.repeat(net.stiffness, 2), len(mass))
    fastest = float(np.sqrt((2 * load / mass).max()))
    ratio = lag * fastest / 2
    return 2 / fastest * (np.sqrt(1 + ratio**2) - ratio)


def swing(
    net: Network,
    mass: np.ndarray,
    lag: float,
    drive: Drive,
    progress: Callable[[float, float, str], None] = lambda *_: None,
    start: np.ndarray | None = None,
) -> Swing:
    """The masses at every frame of the drive, whose particles they are.

    mass: [kg], (V,). lag: b [s]. start: displacement at the first frame [m], (V, 3); none if None.

    Raises Problem where a number is no longer finite.
    """
    springs = np.arange(len(net.pairs))
    ends = np.concatenate([net.pairs, net.pairs[:, ::-1]])
    table = sparse.csr_matrix((np.concatenate([springs, springs]) + 1, ends.T), (len(mass), len(mass)))
    u = np.zeros_like(net.place) if start is None else start.astype(float).copy()
    v, acceleration = np.zeros_like(u), np.zeros_like(u)
    member = np.where(drive.share >= HELD, drive.member, 0)
    constants = net.place, table.indptr, table.indices, table.data - 1, net.length, net.stiffness, mass
    us, vs, joules = [u.copy()], [v.copy()], [(0.0, net.energy(u))]
    for frame in range(1, drive.frames):
        first = (frame - 1) * drive.per_frame
        _march(u, v, acceleration, *constants, lag, member, drive.path, drive.hold, drive.step, first, drive.per_frame)
        if not np.isfinite(u).all():
            raise Problem(
                f"baseline: a displacement is not finite at frame {frame}. Take shorter steps (simulation.refine_step)."
            )
        us.append(u.copy())
        vs.append(v.copy())
        joules.append((0.5 * float((mass[:, None] * v**2).sum()), net.energy(u)))
        progress(frame, drive.frames - 1, f"frame {frame}/{drive.frames - 1}")
    return Swing(np.stack(us), np.stack(vs), np.array(joules))


@njit(cache=True, parallel=True)
def _march(
    u,
    v,
    acceleration,
    place,
    first_of,
    other,
    spring,
    length,
    stiffness,
    mass,
    lag,
    member,
    path,
    hold,
    dt,
    begin,
    steps,
):
    for step in range(begin, begin + steps):
        for i in prange(len(u)):
            ax, ay, az = 0.0, 0.0, 0.0
            for k in range(first_of[i], first_of[i + 1]):
                j, s = other[k], spring[k]
                dx = place[j, 0] + u[j, 0] - place[i, 0] - u[i, 0]
                dy = place[j, 1] + u[j, 1] - place[i, 1] - u[i, 1]
                dz = place[j, 2] + u[j, 2] - place[i, 2] - u[i, 2]
                far = np.sqrt(dx * dx + dy * dy + dz * dz)
                if far == 0.0:
                    continue
                apart = (v[j, 0] - v[i, 0]) * dx + (v[j, 1] - v[i, 1]) * dy + (v[j, 2] - v[i, 2]) * dz
                pull = stiffness[s] * (far - length[s] + lag * apart / far) / far
                ax += pull * dx
                ay += pull * dy
                az += pull * dz
            acceleration[i, 0] = ax / mass[i]
            acceleration[i, 1] = ay / mass[i]
            acceleration[i, 2] = az / mass[i]
        for i in prange(len(u)):
            holders = 0
            to = np.zeros(3)
            if member[i]:
                for a in range(len(path)):
                    if member[i] >> a & 1 and hold[a, step] > 0.5:
                        holders += 1
                        for c in range(3):
                            to[c] += path[a, step + 1, c]
            for c in range(3):
                if holders:
                    v[i, c] = (to[c] / holders - u[i, c]) / dt
                else:
                    v[i, c] += dt * acceleration[i, c]
                u[i, c] += dt * v[i, c]
