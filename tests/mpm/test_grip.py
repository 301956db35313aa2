"""A grip opens when it is said to: between frames, before its last active one, or after it, moving on as it did."""

import numpy as np
import pytest

from surgisim.artifacts.motion import Motion
from surgisim.mpm.grip import drive
from surgisim.problem import Problem

FPS, PER_FRAME, FRAMES = 10.0, 4, 8
REST = np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0]])
WAY = np.array([1e-3, 0.0, 0.0])
"""By which the grip moves from frame to frame [m]."""


def driven(late, active=(1, 2, 3), steps=None):
    """The first particle is gripped in frames `active`, `steps` times WAY away, (T,); the second is held."""
    on = np.isin(np.arange(FRAMES), active)[None]
    steps = np.arange(FRAMES) if steps is None else steps
    motion = Motion(
        np.zeros((1, 3)), np.array([0.01]), (steps[:, None] * WAY * on.T)[None], on, np.ones(1), "given"
    )  # fmt: skip
    after = None if late is None else np.full(on.shape, late)
    return drive(
        motion, REST, np.full(2, 1e-9), np.array([False, True]), fps=FPS, per_frame=PER_FRAME, stiffness=1.0, late=after
    )


@pytest.mark.parametrize(("late", "opens"), [(None, 12), (0.0, 12), (0.5, 14), (0.4, 13.6), (1.3, 17.2), (-1.1, 7.6)])
def test_a_grip_holds_until_it_opens_and_for_a_share_of_the_step_in_which_it_does(late, opens):
    hold = driven(late).hold[1]
    step = np.arange(len(hold))
    assert hold == pytest.approx(np.clip(opens - step, 0, 1) * (step >= PER_FRAME), abs=1e-12)


def test_held_on_to_past_its_last_active_frame_tissue_is_carried_on_as_before():
    path = driven(1.3).path[1]
    # Two frames more at the same speed; without, the grip's path stays what it was given as.
    assert path[16] == pytest.approx(4 * WAY)
    assert path[20] == pytest.approx(5 * WAY)
    assert (driven(0.0).path == driven(None).path).all()
    assert driven(-0.5).path[1][12] == pytest.approx(3 * WAY)


def test_a_grip_that_never_opens_is_held_to_the_end():
    assert (driven(-1.0, active=range(1, FRAMES)).hold[1, PER_FRAME:] == 1).all()


def test_where_it_grips_anew_the_path_that_is_given_counts():
    steps = np.array([0, 1, 2, 3, 0, -2, -3, 0])
    told = driven(1.8, active=(1, 2, 3, 5, 6), steps=steps).path[1]
    assert told[16] == pytest.approx(4 * WAY)
    assert told[20] == pytest.approx(-2 * WAY)


def test_a_patch_of_the_rim_goes_along_all_the_time():
    none = np.zeros((0, FRAMES), bool)
    way = np.arange(FRAMES)[:, None] * WAY
    motion = Motion(
        np.zeros((0, 3)), np.zeros(0), np.zeros((0, FRAMES, 3)), none, np.zeros(0), "found", rim=way[None],
        rim_radius=np.array([0.01]),
    )  # fmt: skip
    found = drive(
        motion, REST, np.full(2, 1e-9), np.array([False, True]), fps=FPS, per_frame=PER_FRAME, stiffness=3.0, grip=0.1
    )
    assert found.member.tolist() == [2, 1]
    assert found.path[1, ::PER_FRAME] == pytest.approx(way)
    assert (found.hold == 1).all()
    # However softly instruments hold.
    assert found.stiffness[1] == pytest.approx(3.0 * np.eye(3))


def test_more_patches_than_a_particle_has_bits_for_are_refused():
    few = Motion(
        np.zeros((0, 3)), np.zeros(0), np.zeros((0, FRAMES, 3)), np.zeros((0, FRAMES), bool), np.zeros(0), "found",
        rim=np.zeros((31, FRAMES, 3)), rim_radius=np.full(31, 0.01),
    )  # fmt: skip
    with pytest.raises(Problem, match="31 patches of the rim, but at most 30"):
        drive(few, REST, np.full(2, 1e-9), np.zeros(2, bool), fps=FPS, per_frame=PER_FRAME, stiffness=1.0)
