"""The base holds by friction only and slides where it is pulled harder.

tangential traction <= c,  and equal to c against the motion where it slides                   [Pa]
"""

from dataclasses import dataclass, replace

import numpy as np

from surgisim.phantom.effect import Effect, Hidden


@dataclass(frozen=True)
class Sliding:
    nodes: np.ndarray
    most: np.ndarray
    """Change of velocity per second that friction can undo [m/s^2], (Q,)."""
    normal: np.ndarray

    def hold(self, x, v, t, dt):
        mine = v[self.nodes]
        mine = mine - np.outer(mine @ self.normal, self.normal)
        speed = np.linalg.norm(mine, axis=1)
        left = np.maximum(speed - self.most * dt, 0.0)
        v[self.nodes] = mine * np.divide(left, speed, out=np.zeros_like(speed), where=speed > 0)[:, None]


def draw(scene, rng, name):
    return Hidden(name)


def traction(scene, hidden):
    """[Pa]"""
    return scene.law.E / hidden.magnitude


def apply(model, hidden):
    nodes = np.flatnonzero(model.mesh.fixed)
    area = np.zeros(len(model.mesh.points))
    faces = model.mesh.cells[:, 4:]
    faces = faces[model.mesh.fixed[faces].all(1)]
    a, b, c, d = (model.mesh.points[faces[:, k]] for k in (0, 1, 3, 2))
    np.add.at(area, faces, np.linalg.norm(np.cross(c - a, d - b), axis=1)[:, None] / 8)
    most = traction(model.scene, hidden) * area[nodes] / model.parts.mass[nodes]
    free = replace(model.mesh, fixed=np.zeros_like(model.mesh.fixed))
    return replace(model, mesh=free, support=Sliding(nodes, most, model.scene.shape.axes[2]))


EFFECT = Effect(draw=draw, apply=apply, parameter="traction", unit="Pa", start=15.0, most=200.0, value=traction)
