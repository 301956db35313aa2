"""What anchors pull is what the tissue between them pulls back."""

import numpy as np
import pytest

from surgisim.artifacts.motion import Motion
from surgisim.mpm.reaction import reactions
from surgisim.mpm.setup import prepare
from surgisim.recordings.fill import fill
from surgisim.recordings.mesh import Mesh

E, WIDTH, PULL, FRAMES = 1e3, 0.012, 1.5e-3, 7


def bar(length: float) -> np.ndarray:
    """Forces along a bar that is held below and pulled at its top, and held there [N], (2, T)."""
    size = np.array([WIDTH, WIDTH, length])
    corner = (np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) - [0.5, 0.5, 0]) * size
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = Mesh(corner, np.array([(a, *pair) for a, b, c, d in sides for pair in ((b, c), (c, d))]))
    body = fill(mesh, spacing=0.004, boxes=np.array([[[-1, -1, -1], [1, 1, 0.008]]]), where="bar")
    course = np.clip(np.arange(FRAMES) / 4, 0, 1)
    top = np.array([[0, 0, length]])
    path = (course**2 * (3 - 2 * course))[:, None] * [0, 0, PULL]
    active = np.ones((1, FRAMES), bool)
    motion = Motion(top, np.array([0.009]), top[:, None] + path[None], active, np.ones(1), source="given")
    values = {"neo_hookean_ciarlet": {"E": E, "nu": 0.40}, "newtonian": {"eta": 8.0}}
    prepared = prepare(body, tuple(values), density=1050.0, carried=body.rest[:1], grips=motion)
    drive = prepared.drive(motion, values, fps=5.0, per_frame=prepared.per_frame(values, 5.0))
    return reactions(prepared.simulator, drive, prepared.simulator.run(prepared.theta(values), drive))[..., 2]


def test_a_bar_pulls_as_its_modulus_says_and_on_both_ends_alike():
    short, long = bar(0.036), bar(0.060)
    for forces in (short, long):
        assert forces[:, 0] == pytest.approx(0.0, abs=1e-6)
        assert forces[0, -1] == pytest.approx(-forces[1, -1], rel=5e-3)
    # Both have the same ends, so that how much more the long one gives is that of the bar between alone.
    more = PULL / long[1, -1] - PULL / short[1, -1]
    assert more == pytest.approx((0.060 - 0.036) / (E * WIDTH**2), rel=0.05)
