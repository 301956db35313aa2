"""The printed step is stable, and no node is left so light that it would ask for a smaller one."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from slab import pulled, slab

from surgisim.artifacts.body import Body
from surgisim.artifacts.motion import Motion
from surgisim.mpm.extension import LEAST
from surgisim.mpm.setup import prepare
from surgisim.problem import Problem

FPS, FRAMES = 25.0, 6
NOBODY = Motion(
    np.zeros((0, 3)), np.zeros(0), np.zeros((0, FRAMES, 3)), np.zeros((0, FRAMES), bool), np.zeros(0), "none"
)


def turned(body: Body, by=(0.5, -0.7, 0.3)) -> Body:
    """`body` slanted against its grid."""
    middle = body.rest.mean(0)
    rest = (body.rest - middle) @ Rotation.from_euler("xyz", by).as_matrix().T + middle
    return Body(rest.astype(np.float32), body.volume, body.color, body.surface, body.held, body.spacing)


def thrown(body: Body, eta: float, squeeze: float):
    """A free body, squeezed to exp(-squeeze) of its length, that swells again at the printed step."""
    values = {"neo_hookean_ciarlet": {"E": 3000.0, "nu": 0.45}, "newtonian": {"eta": eta}}
    made = prepare(body, tuple(values), density=1050.0, precision="double")
    nothing = np.zeros(len(body.rest), bool)
    drive = made.drive(NOBODY, values, fps=FPS, per_frame=made.per_frame(values, FPS), held=nothing)
    nodes = made.simulator.grid.positions()[made.simulator.place]
    u = (nodes - nodes.mean(0)) * np.expm1(squeeze * np.array([-1.0, 0.5, 0.5]))
    v = np.sin(300 * nodes[:, [1, 2, 0]]) * squeeze
    return made.simulator.run(made.theta(values), drive, begin=(u, v))


@pytest.mark.parametrize("eta", [3.0, 30.0, 300.0])
def test_a_squeezed_sheet_of_one_cell_stays_whole_at_the_printed_step(eta):
    out = thrown(turned(slab(size=(0.05, 0.011, 0.004), spacing=0.0045)), eta, 0.5)
    assert np.isfinite(out.u).all()
    assert np.abs(out.v[-1]).max() < 1.0


@pytest.mark.parametrize("by", [(0.0, 0.0, 0.0), (0.6, -0.1, 0.2), (-0.4, -0.2, 1.1)])
def test_no_node_is_left_lighter_than_the_least_share(by):
    made = prepare(turned(slab(spacing=0.0045), by), ("corotated",), density=1050.0)
    mass = made.simulator.mass.numpy()
    assert mass.min() > 0.9 * LEAST * mass.max()


def test_a_grip_that_jumps_is_refused_with_what_would_do():
    body, motion = slab(), pulled()
    jumpy = replace(motion, position=motion.position.copy())
    jumpy.position[0, 3:] += [1.0, 0.0, 0.0]
    made = prepare(body, ("corotated",), density=1050.0)
    values = {"corotated": {"E": 900.0, "nu": 0.4}}
    with pytest.raises(Problem, match=r"grip 0 moves .* in one step .* at least \d+ steps per frame"):
        made.drive(jumpy, values, fps=25.0, per_frame=made.per_frame(values, 25.0))
