"""Two problems with published finite-element solutions, and the same problems solved on converged elements.

Dalton, Husmeier and Gao, Physics-informed graph neural network emulation of soft-tissue mechanics, Comput. Methods
Appl. Mech. Eng. (2023), data of github.com/dodaltuin/soft-tissue-pignn (MIT): displacements by FEniCS, linear
tetrahedra, with psi = mu/2 (tr F^T F - 3) - mu ln J + lambda/2 (ln J)^2. Read off by putting their displacements on
their tetrahedra: only this energy with the parameters below is in balance at every free node (to 1e-11; others leave
3 % and more), and its potential energy is the one they give.

OnceClampedBeam: 10 x 1 x 1 cm, held at x = 0, theta = (mu, lambda) [dyn/cm^2], weight 980 dyn/cm^3 along -z.
TwistingBeam: unit cube, theta = (E, nu), held at x = 0; at x = 1 half way along the chord of a turn by 60 degrees about
the middle of the face, which is a turn by 30 degrees and a shrinking by cos 30.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from surgisim.problem import Problem
from surgisim.verification.static_elements import Mesh, bricks, equilibrium, tetrahedra

DENSITY = 1000.0
"""Of the beam; of no bearing on the cube, which has no weight [kg/m^3]."""


@dataclass(frozen=True)
class Boxes:
    """One geometry and all its solutions, in SI units."""

    size: tuple[float, float, float]
    """[m]"""
    gravity: float
    """Along -z [m/s^2]."""
    far: np.ndarray | None
    """x - center becomes far (x - center) at the far end, (3, 3); None where that end is free."""
    points: np.ndarray
    """Their nodes [m], (N, 3)."""
    cells: np.ndarray
    """Their tetrahedra, (M, 4)."""
    moved: np.ndarray
    """Their displacements [m], (K, N, 3)."""
    mu: np.ndarray
    """[Pa], (K,)."""
    lam: np.ndarray
    """[Pa], (K,)."""

    @property
    def center(self) -> tuple[float, float, float]:
        return (0.0, self.size[1] / 2, self.size[2] / 2)

    @property
    def E(self) -> np.ndarray:
        """Young's modulus [Pa], (K,)."""
        return 2 * self.mu * (1 + self.nu)

    @property
    def nu(self) -> np.ndarray:
        return self.lam / (2 * (self.lam + self.mu))

    def target(self, points: np.ndarray) -> np.ndarray:
        """Displacement of the far end's points, were they there [m], (N, 3); zero where it is free."""
        if self.far is None:
            return np.zeros_like(points)
        return (points - self.center) @ (self.far - np.eye(3)).T

    def solve(self, mesh: Mesh, which: int, *, begin: np.ndarray | None = None) -> np.ndarray:
        """Displacement of the mesh's nodes with the parameters of set `which` [m], (N, 3)."""
        x = mesh.points[:, 0]
        end = np.isclose(x, self.size[0]) & (self.far is not None)
        held = np.repeat(((x < 1e-9) | end)[:, None], 3, 1)
        to = np.where(end[:, None], self.target(mesh.points), 0.0)
        load = (0.0, 0.0, -DENSITY * self.gravity)
        return equilibrium(mesh, self.mu[which], self.lam[which], load, held, to, begin=begin, increments=4)

    def again(self, which: int) -> np.ndarray:
        """Their solution, repeated from their own on their own tetrahedra [m], (N, 3)."""
        return self.solve(tetrahedra(self.points, self.cells), which, begin=self.moved[which])

    def converged(self, which: int, *, finer: bool = False) -> np.ndarray:
        """The same problem's solution on quadratic bricks, at their nodes [m], (N, 3)."""
        mesh = bricks(_cube_edges(finer) if self.far is not None else _beam_edges(finer))
        distance, nearest = cKDTree(mesh.points).query(self.points)
        assert distance.max() < 1e-9 * self.size[0]
        return self.solve(mesh, which)[nearest]


def beam(folder: Path) -> Boxes:
    """The clamped beam under its weight, 100 sets."""
    points, cells, moved, theta = _read(folder / "OnceClampedBeam")
    # Centimetres to metres, dyn/cm^2 to pascals.
    return Boxes((0.1, 0.01, 0.01), 9.8, None, 0.01 * points, cells, 0.01 * moved, *(0.1 * theta))


def cube(folder: Path) -> Boxes:
    """The twisted cube, 50 sets."""
    points, cells, moved, (E, nu) = _read(folder / "TwistingBeam")
    turn = np.pi / 3
    rotation = np.array([[1, 0, 0], [0, np.cos(turn), -np.sin(turn)], [0, np.sin(turn), np.cos(turn)]])
    far = (np.eye(3) + rotation) / 2
    return Boxes(
        (1.0, 1.0, 1.0), 0.0, far, points, cells, moved, E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
    )


def _read(folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    parts = [
        "geometryData/reference-coords",
        "geometryData/elements",
        "simulationData/test/displacement",
        "simulationData/test/theta",
    ]
    files = [folder / f"{p}.npy" for p in parts]
    missing = [str(f) for f in files if not f.is_file()]
    if missing:
        raise Problem(f"fenics: {missing} are not there. Take the folder as its authors published it.")
    points, cells, moved, theta = (np.load(f) for f in files)
    return points, cells.astype(int), moved, theta.T


def _beam_edges(finer: bool) -> tuple[np.ndarray, ...]:
    # Fine at the clamp's edges, where the strain is singular; their nodes are nodes of the bricks.
    along, wide = np.linspace(0, 0.1, 13), np.array([0, 0.25, 0.75, 1]) / 100
    if finer:
        thin = np.array([0, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 1]) / 100
        return np.r_[0, along[1] / 8, along[1] / 4, along[1] / 2, along[1:]], wide, thin
    return np.r_[0, along[1] / 4, along[1:]], wide, np.linspace(0, 0.01, 6)


def _cube_edges(finer: bool) -> tuple[np.ndarray, ...]:
    half = np.array([0, 1 / 36, 1 / 12, 1 / 6] if finer else [0, 1 / 18, 1 / 6])
    return (np.r_[half, 0.5, 1 - half[::-1]],) * 3
