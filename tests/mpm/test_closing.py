"""A grip takes tissue along from where it closes on it."""

import numpy as np
import pytest
from slab import slab

from surgisim.artifacts.motion import Motion
from surgisim.mpm.closing import closings, follow
from surgisim.mpm.setup import prepare

FPS, CLOSES, OPENS, FRAMES = 25.0, 12, 20, 26
TISSUE = {"neo_hookean_ciarlet": {"E": 3000.0, "nu": 0.4}, "newtonian": {"eta": 8.0}}
SAG = {"gravity": {"x": 6.0, "y": 0.0, "z": 0.0, "onset": 0.05}}


def scene(values, ahead=0.0):
    """Sagging tissue; a grip that closes late and stays where it is, or whose path says that it is `ahead` [m]."""
    body = slab()
    top = np.array([[0.0, 0.0, 0.06]])
    active = np.zeros((1, FRAMES), bool)
    active[:, CLOSES:OPENS] = True
    position = np.repeat(top[:, None] + np.array([ahead, 0.0, 0.0]), FRAMES, 1)
    motion = Motion(top, np.array([0.005]), position, active, np.ones(1), "none")
    made = prepare(body, tuple(values), density=1050.0, grips=motion)
    drive = made.drive(motion, values, fps=FPS, per_frame=made.per_frame(values, FPS))
    return made, drive, follow(made.simulator, made.theta(values), drive, last=FRAMES - 1)


def gripped(made, drive, run):
    """Mean displacement along x of what the grip holds [m], (T,)."""
    mine = (drive.member >> 1 & 1).astype(bool)
    carry = made.simulator.carry(made.simulator.rest[mine])
    return np.array([(carry @ u.astype(float))[:, 0].mean() for u in run.u])


def test_sagged_tissue_is_held_where_it_hangs():
    x = gripped(*scene(TISSUE | SAG))
    assert x[CLOSES] > 3e-4
    assert x[OPENS - 2] == pytest.approx(x[CLOSES], rel=0.05)


def test_a_path_that_says_where_it_holds_is_believed():
    x = gripped(*scene(TISSUE | SAG, ahead=-3e-4))
    assert x[OPENS - 2] == pytest.approx(-3e-4, rel=0.3)


def test_tissue_at_rest_is_carried_as_ever():
    made, drive, run = scene(TISSUE)
    plain = made.simulator.run(made.theta(TISSUE), drive)
    assert closings(drive) == [(1, CLOSES, (OPENS - 1) * drive.per_frame)]
    np.testing.assert_allclose(run.u, plain.u, atol=1e-8)
    np.testing.assert_allclose(run.v, plain.v, atol=1e-6)
