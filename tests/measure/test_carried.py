"""Points that are no particles go where the grid and the particles beside them go."""

import numpy as np
import pytest
from slab import pulled, slab

from surgisim.artifacts.replay import Replay
from surgisim.measure.carried import carried
from surgisim.mpm.setup import prepare

LAWS = {"corotated": {"E": 900.0, "nu": 0.4}, "newtonian": {"eta": 1.0}}


def test_a_bend_at_a_grip_that_no_grid_has_is_carried_too():
    body, motion = slab(), pulled(frames=8, hold=8)
    made = prepare(body, tuple(LAWS), density=1050.0, grips=motion)
    run = made.simulator.run(
        made.theta(LAWS), made.drive(motion, LAWS, fps=25.0, per_frame=2 * made.per_frame(LAWS, 25.0))
    )
    grid, rest = made.simulator.grid, body.rest.astype(float)
    carry = made.simulator.carry(rest)
    replay = Replay(
        np.arange(8) / 25.0, np.stack([rest + carry @ u.astype(float) for u in run.u]).astype(np.float32),
        made.simulator.displaced(run.u).astype(np.float32), grid.origin, grid.shape, grid.spacing, np.ones(8),
        np.zeros((8, 2)), np.zeros((0, 1, 1, 3), np.uint8),
    )  # fmt: skip
    path = carried(replay, body, rest)
    assert path[:, -1] == pytest.approx(replay.position[-1], abs=2e-5)
    beside = np.array([[0.0072, 0.0003, 0.0605], [0.0, -0.0081, 0.061]])
    true = beside + made.simulator.carry(beside) @ run.u[-1].astype(float)
    assert carried(replay, body, beside)[:, -1] == pytest.approx(true, abs=3e-4)
    splines = Replay(**{**vars(replay), "position": np.stack([rest + 0 * rest] * 8).astype(np.float32)})
    assert np.abs(carried(splines, body, beside)[:, -1] - true).max() > 1e-3
    assert np.isnan(carried(replay, body, beside - np.array([0.0, 0.0, 0.02]))).all()
