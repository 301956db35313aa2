"""Splats and a surface that follow a body, as the browser wants them: centimetres, covariances."""

from dataclasses import dataclass

import numpy as np
import torch
import trimesh
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from surgisim.artifacts.scene import Scene
from surgisim.deformation.field import load_field
from surgisim.gaussians.attributes import drawn
from surgisim.mpm.carried import Carried
from surgisim.mpm.grid import Grid
from surgisim.mpm.nodes import Nodes
from surgisim.viewer.case import Case

SCALE = 100.0
"""Shown lengths a metre: in metres the covariances of millimetres drown in half precision."""


@dataclass(frozen=True)
class Shown:
    """Splats as the browser draws them."""

    center: np.ndarray
    """[cm], (G, 3)."""
    covariance: np.ndarray
    """[cm^2], (G, 3, 3)."""


def shown(mean: np.ndarray, factor: np.ndarray) -> Shown:
    """Of means [m], (G, 3), and factors M of covariances M M^T [m], (G, 3, 3)."""
    factor = SCALE * factor
    return Shown(SCALE * mean, factor @ factor.transpose(0, 2, 1))


def factors(rotation: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """(G, 3, 3) [m] of quaternions w, x, y, z, (G, 4), and radii [m], (G, 3)."""
    turn = Rotation.from_quat(np.asarray(rotation, float), scalar_first=True).as_matrix()
    return turn * np.asarray(scale, float)[:, None, :]


class GridNodes:
    """A replay's grid, whose every node carries: what `Carried` asks of a body's nodes."""

    def __init__(self, origin: np.ndarray, shape: np.ndarray, spacing: float) -> None:
        self.grid = Grid(np.asarray(origin, float), np.asarray(shape), float(spacing))
        self.place = np.arange(self.grid.count)

    def links(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        index, weight, gradient = self.grid.stencil(points)
        return index, np.concatenate([weight[..., None], gradient], -1)


class Follower:
    """Everything that is drawn, bound to a body."""

    def __init__(self, case: Case, nodes: Nodes | GridNodes) -> None:
        mean, rotation, scale, *_ = drawn(case.scene)
        self.splats, self.factor = Carried(mean, nodes), factors(rotation, scale)
        self.particles = Carried(case.body.rest, nodes)
        mesh = trimesh.load(case.mesh, process=False)
        self.faces, vertices = np.asarray(mesh.faces), np.asarray(mesh.vertices)
        # A vertex of the closed surface may lie off the grid: it goes with the particle next to it.
        beside = cKDTree(case.body.rest).query(vertices)[1]
        self.vertices, self.arm = Carried(case.body.rest[beside], nodes), vertices - case.body.rest[beside]

    def scene(self, u: np.ndarray) -> Shown:
        """At displacements of the nodes [m], (A, 3)."""
        mean, F = self.splats.at(u)
        return shown(mean, F @ self.factor)

    def surface(self, u: np.ndarray) -> np.ndarray:
        """Vertices [cm], (V, 3)."""
        at, F = self.vertices.at(u)
        return SCALE * (at + np.einsum("vab,vb->va", F, self.arm))

    def body(self, u: np.ndarray) -> np.ndarray:
        """Particles [m], (P, 3)."""
        return self.particles.at(u)[0]


class FollowerOnDevice:
    """Splats bound to a simulator's nodes on a GPU; only what the browser draws leaves it."""

    def __init__(self, case: Case, simulator: Nodes) -> None:
        mean, rotation, scale, *_ = drawn(case.scene)
        index, link = simulator.links(np.asarray(mean, float))

        def put(array: np.ndarray) -> torch.Tensor:
            return torch.as_tensor(np.ascontiguousarray(array, np.float32), device="cuda")

        self.index = torch.as_tensor(index, device="cuda")
        self.weight, self.slope = put(link[..., 0]), put(link[..., 1:])
        # One of its own: on the default stream it would wait for the steps that are simulated meanwhile, or break their
        # capture.
        self.stream = torch.cuda.Stream()
        self.mean, self.factor, self.eye = put(SCALE * mean), put(SCALE * factors(rotation, scale)), put(np.eye(3))

    def scene(self, u: np.ndarray) -> Shown:
        """At displacements of the solid nodes [m], (A, 3)."""
        with torch.cuda.stream(self.stream):
            moved = torch.as_tensor(np.ascontiguousarray(u, np.float32), device="cuda")[self.index]
            center = self.mean + SCALE * torch.einsum("gk,gka->ga", self.weight, moved)
            factor = (self.eye + torch.einsum("gka,gkb->gab", moved, self.slope)) @ self.factor
            return Shown(center.cpu().numpy(), (factor @ factor.transpose(1, 2)).cpu().numpy())


class Reconstructed:
    """The scene as its own deformation field moves it: no physics."""

    def __init__(self, case: Case) -> None:
        self.field, self.source = load_field(case.deformation), case.scene

    @torch.no_grad()
    def scene(self, time: float) -> Shown:
        """At a time of the clip [s]."""
        scene: Scene = self.source
        mean = torch.from_numpy(np.ascontiguousarray(scene.mean, np.float32))
        moved, _, turn, grow = (part.numpy() for part in self.field(mean, time))
        return shown(scene.mean + moved, factors(scene.rotation + turn, np.exp(scene.scale + grow)))
