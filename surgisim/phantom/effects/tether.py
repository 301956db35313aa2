"""An adhesion: short strands from a patch of tissue to something below that does not move, slack at first.

f = k max(0, |x - b| - (L + slack)) toward b                      [N], pulling only, k shared among the strands
"""

import numpy as np

from surgisim.phantom.effect import Effect, Hidden, near_grip
from surgisim.phantom.loads import Springs, always


def draw(scene, rng, name):
    near = scene.holds[0].grip.radius
    at = near_grip(scene, rng, (near + 0.001, near + 0.007), (0.0, 0.3))
    numbers = {"slack": (rng.uniform(0.1e-3, 1.0e-3), "m"), "length": (rng.uniform(1e-3, 4e-3), "m")}
    return Hidden(name, center=at, extent=rng.uniform(0.004, 0.008), numbers=numbers)


def apply(model, hidden):
    points, scene = model.mesh.points, model.scene
    share = hidden.share(points) * ~model.mesh.fixed * ~model.mesh.gripped[0]
    nodes = np.flatnonzero(share > 1e-3)
    length = np.full(len(nodes), hidden.number("length"))
    feet = points[nodes] + length[:, None] * scene.shape.axes[2]
    # By volume, so that the patch does not depend on the mesh.
    share = (share * model.parts.mass)[nodes]
    stiffness = hidden.magnitude * scene.law.E * hidden.extent * share / share.sum()
    still = np.zeros(3)
    return model.with_force(Springs(nodes, stiffness, feet, length, hidden.number("slack"), lambda t: still, always))


EFFECT = Effect(
    draw=draw,
    apply=apply,
    parameter="k",
    unit="N/m",
    start=10.0,
    most=200.0,
    value=lambda scene, hidden: hidden.magnitude * scene.law.E * hidden.extent,
)
