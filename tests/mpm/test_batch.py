"""Bodies side by side in one run move as each does alone."""

from dataclasses import replace

import numpy as np
import pytest
from slab import pulled, slab

from surgisim.mpm.batch import Batch
from surgisim.mpm.setup import prepare
from surgisim.mpm.simulator import Breakdown
from surgisim.problem import Problem

VALUES = [{"corotated": {"E": E, "nu": nu}, "newtonian": {"eta": 2.0}} for E, nu in ((1500.0, 0.42), (900.0, 0.3))]


def runs(made, motion, frames=5, pulls=(1.0, 0.6, -0.4)):
    """Drives and thetas of three different runs of one body."""
    drives, thetas = [], []
    for k, share in enumerate(pulls):
        values = VALUES[k % 2]
        path = motion.center_rest[:, None] + share * (motion.position - motion.center_rest[:, None])
        motion_k = replace(motion, position=path)
        drives.append(made.drive(motion_k, values, fps=25.0, per_frame=made.per_frame(VALUES[0], 25.0), frames=frames))
        thetas.append(made.theta(values))
    return thetas, drives


@pytest.mark.parametrize("grips", [False, True])
def test_every_copy_moves_as_the_body_does_alone(grips):
    motion = pulled()
    made = prepare(slab(), tuple(VALUES[0]), density=1050.0, precision="double", grips=motion if grips else None)
    thetas, drives = runs(made, motion)
    # Four copies for three runs: one stands still.
    together = Batch(made, 4).run(thetas, drives)
    for run, theta, drive in zip(together, thetas, drives, strict=True):
        alone = made.simulator.run(theta, drive)
        assert np.abs(alone.u).max() > 1e-4
        assert np.abs(run.u - alone.u).max() < 1e-9 * np.abs(alone.u).max()


def test_more_runs_than_copies_take_turns():
    motion = pulled()
    made = prepare(slab(), tuple(VALUES[0]), density=1050.0)
    thetas, drives = runs(made, motion, frames=3)
    together = Batch(made, 2).run(thetas, drives)
    assert len(together) == 3
    alone = made.simulator.run(thetas[2], drives[2])
    assert np.abs(together[2].u - alone.u).max() < 1e-4 * np.abs(alone.u).max()


def test_one_that_breaks_down_leaves_the_others_whole():
    motion = pulled()
    made = prepare(slab(), tuple(VALUES[0]), density=1050.0)
    thetas, drives = runs(made, motion, frames=5, pulls=(1.0, 20.0, 0.5))
    first, torn, last = Batch(made, 3).run(thetas, drives)
    assert isinstance(torn, Breakdown)
    assert np.isfinite(first.u).all()
    assert np.isfinite(last.u).all()


def test_runs_at_once_need_one_step():
    motion = pulled()
    made = prepare(slab(), tuple(VALUES[0]), density=1050.0)
    thetas, drives = runs(made, motion, frames=3)
    with pytest.raises(Problem, match="one step"):
        Batch(made, 3).run(thetas, [replace(drives[0], step=drives[0].step / 2), *drives[1:]])
