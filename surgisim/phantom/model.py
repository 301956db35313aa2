"""A meshed scene with the forces, masses and supports that an effect may change."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from surgisim.phantom.elements import LANES, Elements, elements
from surgisim.phantom.ogrid import Mesh, mesh
from surgisim.phantom.scene import Scene
from surgisim.phantom.strains import Patch, patch


class Force(Protocol):
    """Something that pushes nodes, or changes what the elements are made of, each step anew."""

    def add(self, x: np.ndarray, v: np.ndarray, t: float, dt: float, force: np.ndarray) -> None:
        """Add to `force` [N] (N, 3) at positions x [m], velocities v [m/s] and time t [s]; memory advances by dt."""


class Support(Protocol):
    """What holds the base."""

    def hold(self, x: np.ndarray, v: np.ndarray, t: float, dt: float) -> None:
        """Correct the base's velocities after forces have acted, t [s] being the end of the step."""


@dataclass(frozen=True)
class Still:
    """Does not move."""

    nodes: np.ndarray

    def hold(self, x, v, t, dt):
        v[self.nodes] = 0.0


@dataclass(frozen=True)
class Model:
    scene: Scene
    mesh: Mesh
    parts: Elements
    support: Support
    grasp: tuple[Callable[[float, np.ndarray], np.ndarray], ...]
    """Displacement that each grip gives to its nodes [m], (Q, 3), at a time [s]; Q places at rest [m], (Q, 3)."""
    forces: tuple[Force, ...] = ()
    burden: tuple[np.ndarray, Callable[[float], float]] | None = None
    """Mass added at the nodes [kg], (N,), and the share of it that is there at a time [s]."""
    reserve: tuple[float, float] = (0.0, 0.0)
    """Shear modulus [Pa] and viscosity [Pa s] that `forces` may add, for the choice of steps."""

    def with_force(self, force: Force, *, mu: float = 0.0, eta: float = 0.0) -> "Model":
        return replace(self, forces=(*self.forces, force), reserve=(self.reserve[0] + mu, self.reserve[1] + eta))

    def with_moduli(self, factor: np.ndarray) -> "Model":
        """mu and lambda of every element times `factor`, (M,)."""
        lanes = in_lanes(factor)
        return replace(self, parts=replace(self.parts, mu=self.parts.mu * lanes, lam=self.parts.lam * lanes))

    def with_viscosity(self, added: np.ndarray) -> "Model":
        """eta of every element plus `added` [Pa s], (M,)."""
        return replace(self, parts=replace(self.parts, eta=self.parts.eta + in_lanes(added)))

    def patch(self, share: np.ndarray | None = None) -> Patch:
        return patch(self.mesh.points, self.mesh.cells, share)

    @property
    def centers(self) -> np.ndarray:
        """Of the elements at rest [m], (M, 3)."""
        return self.mesh.points[self.mesh.cells].mean(1)


def model(scene: Scene, spacing: float) -> Model:
    """The scene with nothing concealed, in elements of about `spacing` [m]."""
    return of_mesh(scene, mesh(scene.shape, tuple(h.grip for h in scene.holds), spacing))


def of_mesh(scene: Scene, block: Mesh) -> Model:
    """The scene with nothing concealed, in these elements."""
    grasp = tuple(lambda t, rest, h=h: np.tile(h.path(t * scene.fps), (len(rest), 1)) for h in scene.holds)
    parts = elements(block.points, block.cells, scene.law)
    return Model(scene, block, parts, Still(np.flatnonzero(block.fixed)), grasp)


def in_lanes(values: np.ndarray) -> np.ndarray:
    """A number for every element, (M,), in the order of the force kernel, (B, LANES)."""
    return np.concatenate([values, np.full(-len(values) % LANES, values[0])]).reshape(-1, LANES)
