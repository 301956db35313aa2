"""What is done by hand is what a replay of the exported operation does."""

import json
from dataclasses import replace

import numpy as np
import pytest
from cases import CAMERA, quiet

from surgisim.config.simulation import Simulation
from surgisim.mpm.carried import Carried
from surgisim.mpm.cut import Cut
from surgisim.mpm.setup import prepare, values_of
from surgisim.physics.catalogue import choose, columns
from surgisim.problem import Problem
from surgisim.simulation.replay import replay
from surgisim.viewer.manipulation import Grasp, Manipulation, under

LEFT, RIGHT = Grasp((-0.012, 0.0, 0.062), 0.007), Grasp((0.012, 0.0, 0.062), 0.007)


def dragged(hand, frames, let_go=None, cut_at=None):
    """Drag every grip about, and say where the particles are at every frame."""
    rng, wanted, seen = np.random.default_rng(4), np.zeros((len(hand.grasps), 3)), {}
    for k in range(frames):
        wanted = wanted + rng.normal(0, 6e-4, wanted.shape) + [2e-4, 0, -6e-4]
        if k == cut_at:
            hand.sever()
        hand.advance(wanted, np.full(len(wanted), let_go is None or k < let_go))
        seen[hand.frame] = Carried(np.asarray(hand.simulator.rest), hand.active).at(hand.state[0])[0]
    return seen


def repeated(case, hand):
    operation = json.loads(json.dumps(hand.operation()))
    settings = Simulation(operation=operation, render=False)
    return replay(case.body, case.scene, case.material, case.physics, case.motion, CAMERA, settings, quiet).position


@pytest.mark.parametrize(
    ("grasps", "cut", "let_go"),
    [
        ((LEFT,), None, None),
        ((LEFT, RIGHT), None, 9),
        ((LEFT, RIGHT), Cut(np.array([0.0, -0.012, 0.0615]), np.array([0.0, 0.012, 0.0615]), 0.01), 11),
    ],
)
def test_the_exported_operation_repeats_what_the_hand_did(case, grasps, cut, let_go):
    hand = Manipulation(case, grasps, cut)
    seen = dragged(hand, 16, let_go, cut_at=5 if cut is not None else None)
    again, size = repeated(case, hand), np.ptp(case.body.rest, axis=0).max()
    assert np.abs(seen[8] - case.body.rest).max() > 0.05 * size
    for frame, there in seen.items():
        assert np.abs(there - again[frame]).max() < 1e-6 * size


def test_a_grip_follows_no_faster_than_half_a_cell_a_frame(case):
    hand = Manipulation(case, (LEFT,))
    for _ in range(4):
        hand.advance(np.array([[0.0, 0.0, -0.03]]), [True])
    steps = np.diff(np.array(hand._offsets)[:, 0, 2])
    assert np.allclose(steps, -0.5 * case.body.spacing)


def test_back_to_rest_forgets_everything(case):
    hand = Manipulation(case, (LEFT,))
    dragged(hand, 5)
    hand.reset()
    assert hand.frame == 0
    assert not hand.state[0].any()
    with pytest.raises(Problem, match="nothing was done yet"):
        hand.operation()


def test_a_ray_meets_the_tissue_that_is_nearest_along_it(case):
    hit = under(case, np.zeros(3), np.array([0.005, 0.004, 0.06]))
    assert case.body.surface[hit]
    assert np.linalg.norm(case.body.rest[hit] / case.body.rest[hit, 2] * 0.06 - [0.005, 0.004, 0.06]) < 0.003
    assert under(case, np.zeros(3), np.array([1.0, 0.0, 0.1])) is None


def named(case, **laws):
    """The case with a diagnosis that named these laws."""
    terms = {law: {n: {"value": v, "unit": ""} for n, v in numbers.items()} for law, numbers in laws.items()}
    physics = replace(case.physics, terms=case.physics.terms | terms)
    theta = prepare(case.body, tuple(physics.terms), density=physics.density).theta(values_of(physics))
    return physics, replace(case.material, names=np.array(columns(choose(physics.terms))), values=theta)


def test_a_law_that_was_named_moves_the_body_by_hand(case):
    drag = named(case, drag={"c": 40.0})
    plain, slowed = (Manipulation(case, (LEFT,), physics=physics) for physics in (None, drag))
    for hand in (plain, slowed):
        dragged(hand, 6)
    assert np.abs(plain.state[0] - slowed.state[0]).max() > 1e-5


def test_a_law_that_acts_by_the_clock_is_refused_by_hand(case):
    weight = named(case, gravity={"x": 0.0, "y": 9.8, "z": 0.0, "onset": 0.1})
    with pytest.raises(Problem, match="gravity acts at times of the recording"):
        Manipulation(case, (LEFT,), physics=weight)
