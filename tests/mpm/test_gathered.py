"""The GPU's way to step and to sum, run on the CPU against the CPU's own way."""

import dataclasses

import numpy as np
import pytest
from slab import pulled, slab

from surgisim.mpm import simulator
from surgisim.mpm.setup import prepare

VALUES = {
    "corotated": {"E": 1500.0, "nu": 0.42},
    "newtonian": {"eta": 2.0},
    "relaxation": {"G": 400.0, "tau": 0.1},
    "drag": {"c": 2.0},
}


@pytest.mark.parametrize("grips", [False, True])
def test_particle_by_particle_moves_the_body_as_cell_by_cell_does_and_gives_the_same_gradient(monkeypatch, grips):
    def one():
        body, motion = slab(), pulled()
        made = prepare(body, tuple(VALUES), density=1050.0, precision="double", grips=motion if grips else None)
        path = made.drive(motion, VALUES, fps=25.0, per_frame=made.per_frame(VALUES, 25.0), frames=4)
        theta = made.theta(VALUES)
        run = made.simulator.run(theta, path)
        weight = np.random.default_rng(0).standard_normal(run.u.shape)
        back = made.simulator.gradient(theta, path, run, weight, springs=True)
        return run.u, back.theta, back.path, back.stiffness

    added = one()
    monkeypatch.setattr(simulator, "by_cell", lambda device: False)
    for ours, theirs in zip(one(), added, strict=True):
        assert np.linalg.norm(ours - theirs) < 1e-10 * np.linalg.norm(theirs)


def test_a_node_gathers_only_what_weighs_something(monkeypatch):
    monkeypatch.setattr(simulator, "by_cell", lambda device: False)
    motion = pulled()
    two = dataclasses.replace(
        motion, **{k: np.concatenate([v, v]) for k, v in vars(motion).items() if isinstance(v, np.ndarray)}
    )
    gathered = {}
    for name, grips in (("none", None), ("two", two)):
        made = prepare(slab(), tuple(VALUES), density=1050.0, grips=grips).simulator
        start, _, node, _ = (a.numpy() for a in made.layout.pieces)
        gathered[name] = np.bincount(node, np.diff(start))[: made.rule.shape[1]]
    assert (gathered["two"] <= gathered["none"]).all()
