"""A thin box holds a plane, whatever the grid: tissue above it shears as a layer glued to a table does."""

import numpy as np
import pytest
from solids import box

from surgisim.mpm.setup import prepare
from surgisim.recordings.fill import fill
from surgisim.recordings.mesh import closed
from surgisim.recordings.recording import no_grips

SIZE, GLUED = (0.036, 0.030, 0.012), 3e-4
TISSUE = {"neo_hookean_ciarlet": {"E": 3000.0, "nu": 0.4}, "newtonian": {"eta": 15.0}}
FPS, FRAMES, PULL = 20.0, 9, (2.0, 0.0, 0.0)


def layer(spacing: float):
    glued = np.array([[[-1.0, -1.0, -1.0], [1.0, 1.0, GLUED]]])
    return fill(closed(box(SIZE), "layer"), spacing=spacing, boxes=glued)


def shift(spacing: float) -> float:
    """Along its weight, of the middle of its upper side, when it has come to rest [m]."""
    made = prepare(layer(spacing), tuple(TISSUE), density=1050.0, gravity=PULL)
    drive = made.drive(no_grips(FRAMES), TISSUE, fps=FPS, per_frame=made.per_frame(TISSUE, FPS), frames=FRAMES)
    run = made.simulator.run(made.theta(TISSUE), drive)
    before, end = (made.simulator.carry(np.array([[0.018, 0.015, 0.012]])) @ u.astype(float) for u in run.u[-2:])
    assert end[0, 0] == pytest.approx(before[0, 0], rel=0.01), "it has come to rest"
    return float(end[0, 0])


def test_a_layer_glued_to_a_plane_shears_alike_on_every_grid():
    coarse, middle, fine = (shift(spacing) for spacing in (0.006, 0.004, 0.003))
    assert coarse == pytest.approx(middle, rel=0.03)
    assert middle == pytest.approx(fine, rel=0.03)


@pytest.mark.parametrize("spacing", [0.006, 0.004])
def test_a_layer_of_particles_that_a_box_cuts_is_not_held_whole(spacing):
    body = layer(spacing)
    size = spacing / 2
    held = body.volume[body.held].sum() / body.volume.sum()
    assert held == pytest.approx(GLUED / SIZE[2], rel=0.05)
    assert held < 0.2 * size / SIZE[2]
    low = body.rest[:, 2] < size
    assert (low & ~body.held).any()
    assert body.rest[body.held, 2].max() < GLUED
