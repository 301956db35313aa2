"""An adhesion: strands from a patch of tissue to the base, slack at first, pulling only.

    f = k max(0, |x - b| - (L + slack)) toward b                      [N], k shared among the patch's strands
"""

import numpy as np

from surgisim.phantom.effect import Effect, Hidden, near_grip
from surgisim.phantom.loads import Springs, always


def draw(scene, rng, name):
    at = near_grip(scene, rng, (0.004, 0.013), (0.0, 0.35))
    slack = rng.uniform(0.2e-3, 1.2e-3)
    return Hidden(name, center=at, extent=rng.uniform(0.004, 0.006), numbers={"slack": (slack, "m")})


def apply(model, hidden):
    points, scene = model.mesh.points, model.scene
    share = hidden.share(points) * ~model.mesh.fixed
    nodes = np.flatnonzero(share > 1e-3)
    feet = points[nodes].copy()
    feet[:, 2] = points[model.mesh.fixed, 2].mean()
    # By volume, so that the patch does not depend on the mesh.
    share = (share * model.parts.mass)[nodes]
    stiffness = hidden.magnitude * scene.law.E * hidden.extent * share / share.sum()
    length = np.linalg.norm(feet - points[nodes], axis=1)
    still = np.zeros(3)
    return model.with_force(
        Springs(nodes, stiffness, feet, length, hidden.number("slack"), lambda t: still, always)
    )


EFFECT = Effect(
    draw=draw,
    apply=apply,
    parameter="k",
    unit="N/m",
    start=4.0,
    most=60.0,
    value=lambda scene, hidden: hidden.magnitude * scene.law.E * hidden.extent,
)
