"""A small block that is pulled twice, and single elements, to see what each concealed effect does."""

import numpy as np
from tissue_pieces import box

from surgisim.phantom.block import Grip, Shape
from surgisim.phantom.effect import Hidden, catalogue
from surgisim.phantom.elements import elements
from surgisim.phantom.law import Law
from surgisim.phantom.model import Model, Still, model
from surgisim.phantom.ogrid import Mesh
from surgisim.phantom.scene import Hold, Scene

SPACING = 4.2e-3
PULL = np.array([0.0035, 0.0, 0.003])


def block() -> Scene:
    half = np.array([0.020, 0.015])
    axes = np.diag([1.0, -1.0, -1.0])
    shape = Shape(np.zeros(3), axes, -half, half, 0.0125, np.zeros((1, 4)))
    holds = (
        Hold(Grip(np.array([-0.006, 0.0]), 0.0045), PULL, 4, 12, 30),
        Hold(Grip(np.array([0.007, 0.0]), 0.0045), 0.7 * PULL, 44, 50, 54),
    )
    u, v = np.meshgrid(np.linspace(-0.018, 0.018, 13), np.linspace(-0.013, 0.013, 9))
    probes = np.stack([u.ravel(), v.ravel()], 1)
    return Scene(shape, Law(2000.0, 0.42, 5.0, 1050.0), holds, 58, 25.0, 42, np.array([0, 0, -9.81]), probes)


def drawn(name: str, seed: int = 5) -> Hidden:
    return catalogue()[name].draw(block(), np.random.default_rng(seed), name)


def with_effect(hidden: Hidden, magnitude: float | None = None) -> Model:
    effect = catalogue()[hidden.name]
    return effect.apply(model(block(), SPACING), hidden.scaled(effect.start if magnitude is None else magnitude))


def cube(hidden: Hidden, magnitude: float | None = None) -> Model:
    """Two by two by two elements of 1 cm, nothing held, with the effect."""
    points, cells = box((2, 2, 2), (0.01, 0.01, 0.01))
    points, none = points - 0.005, np.zeros(27, bool)
    mesh = Mesh(points, points[:, :2], cells, none, np.zeros((2, 27), bool), points[:, 2] > 0.0049)
    scene = block()
    plain = Model(scene, mesh, elements(points, cells, scene.law), Still(np.flatnonzero(none)), ())
    effect = catalogue()[hidden.name]
    return effect.apply(plain, hidden.scaled(effect.start if magnitude is None else magnitude))


def stress(model: Model, F: np.ndarray, *, t: float = 0.0, dt: float = 0.0) -> np.ndarray:
    """Mean first Piola-Kirchhoff stress [Pa] that the effect adds to a cube deformed by F."""
    x = model.mesh.points @ F.T
    force = np.zeros_like(x)
    for each in model.forces:
        each.add(x, np.zeros_like(x), t, dt, force)
    return -force.T @ model.mesh.points / 1e-6


def sheared(by: float) -> np.ndarray:
    F = np.eye(3)
    F[0, 1] = by
    return F
