"""A recording runs: held where its boxes are, carried where its grips go."""

import numpy as np
from solids import recording

from surgisim.mpm.setup import prepare

VALUES = {"corotated": {"E": 3000.0, "nu": 0.4}, "newtonian": {"eta": 2.0}}


def run(made):
    prepared = prepare(
        made.body(0.005), tuple(VALUES), density=made.density, gravity=made.gravity, carried=made.attached()
    )
    per_frame = prepared.per_frame(VALUES, made.fps)
    drive = prepared.drive(made.motion, VALUES, fps=made.fps, per_frame=per_frame, frames=made.frames)
    out = prepared.simulator.run(prepared.theta(VALUES), drive)
    return np.stack([prepared.simulator.carry(made.attached()) @ u for u in out.u.astype(float)], 1)


def test_a_grip_lifts_the_points_around_it():
    moved = run(recording(gravity=(0.0, 0.0, 0.0)))
    assert moved.shape == (4, 6, 3)
    assert (moved[:, -1, 2] > 0.0005).all()
    assert (moved[:, -1, 2] < 0.003).all()


def test_without_grips_it_only_sags():
    moved = run(recording(grips=0))
    assert (moved[:, 1:, 2] < 0).all()
    assert np.abs(moved[..., 2]).max() < 0.002
