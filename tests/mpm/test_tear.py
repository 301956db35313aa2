"""Tissue that is not joined to what lies beside it."""

from dataclasses import replace

import numpy as np
import pytest
from slab import pulled, slab

from surgisim.artifacts.base import load, save
from surgisim.artifacts.body import Body
from surgisim.mpm.cut import Cut
from surgisim.mpm.setup import prepare
from surgisim.mpm.tear import Either, Tear, severed
from surgisim.problem import Problem

WALL = np.array([[[0.0, -0.03], [0.0, 0.03]]])
SOFT = {"corotated": {"E": 900.0, "nu": 0.4}, "newtonian": {"eta": 1.0}}
FPS = 25.0


def test_a_wall_is_crossed_between_its_ends_at_any_depth():
    tear = Tear(np.array([[[0.0, 0.0], [0.0, 1.0]], [[0.0, 1.0], [2.0, 1.0]]]))
    left, right = np.array([-1.0, 0.5, 0.0]), np.array([[1.0, 0.5, 7.0], [1.0, -0.6, 0.0], [-0.5, 0.9, 0.0]])
    assert tear.crosses(left, right).tolist() == [True, False, False]
    assert tear.crosses(np.array([1.0, 0.5, 0.0]), np.array([1.0, 1.5, 0.0])).all()
    assert not Tear(np.zeros((0, 2, 2))).crosses(left, right).any()


def test_several_sever_where_any_does():
    cut = Cut(np.array([0.01, -0.02, 0.06]), np.array([0.01, 0.02, 0.06]), 0.02)
    both = severed(Tear(WALL), cut)
    assert isinstance(both, Either)
    a = np.array([[-0.001, 0.0, 0.062], [0.009, 0.0, 0.062], [0.002, 0.0, 0.062]])
    b = np.array([[0.001, 0.0, 0.062], [0.012, 0.0, 0.062], [0.004, 0.0, 0.062]])
    assert both.crosses(a, b).tolist() == [True, True, False]
    assert severed(None, cut) is cut
    assert severed(None, None) is None


def after_a_pull(body: Body) -> np.ndarray:
    """How far particles went [m], (P, 3), when a grip took the slab's right half along."""
    motion = pulled(by=(0.004, 0.0, -0.004))
    aside = np.array([0.012, 0.0, 0.0])
    motion = replace(motion, center_rest=motion.center_rest + aside, position=motion.position + aside)
    made = prepare(body, tuple(SOFT), density=1050.0, grips=motion)
    steps = made.per_frame(SOFT, FPS)
    run = made.simulator.run(made.theta(SOFT), made.drive(motion, SOFT, fps=FPS, per_frame=steps), last=6)
    return made.simulator.carry(body.rest.astype(float)) @ run.u[6].astype(float)


def test_what_is_torn_stays_where_the_whole_is_dragged_along():
    body = slab()
    x, y, z = body.rest.T
    beside = (x < 0) & (x > -0.006) & (np.abs(y) < 0.006) & (z < 0.066)
    dragged, left = (
        np.linalg.norm(u[beside], axis=1).mean() for u in map(after_a_pull, (body, replace(body, torn=WALL)))
    )
    assert dragged > 5e-4
    assert left < 0.02 * dragged


def test_a_torn_body_that_is_cut_elsewhere_goes_on_from_where_it_was():
    body = replace(slab(), torn=WALL)
    cut = Cut(np.array([0.018, -0.03, 0.06]), np.array([0.018, 0.03, 0.06]), 0.02)
    before, after = (prepare(body, tuple(SOFT), density=1050.0, cut=c).simulator for c in (None, cut))
    place = before.grid.positions()[before.place % before.grid.count]
    # The two sides of the wall have gone opposite ways.
    u = np.where(before.place < before.grid.count, 1.0, -1.0) * np.where(place[:, 0] > 0, 1.0, -1.0)
    u = np.stack([1e-3 * u, np.zeros(len(u)), np.zeros(len(u))], 1)
    rest = body.rest.astype(float)
    away = np.abs(rest[:, 0] - 0.018) > 0.009
    was, goes_on = before.carry(rest) @ u, after.carry(rest) @ after.inherited(before, u)
    assert np.abs(was[:, 0]) == pytest.approx(1e-3, rel=1e-6)
    assert goes_on[away] == pytest.approx(was[away], abs=1e-9)


def test_a_torn_body_is_kept_and_one_from_before_is_whole(tmp_path):
    body = replace(slab(), torn=WALL)
    save(body, tmp_path / "torn.npz", producer="test", settings={}, code="")
    assert load(Body, tmp_path / "torn.npz").torn == pytest.approx(WALL)
    with np.load(tmp_path / "torn.npz") as kept:
        np.savez(tmp_path / "before.npz", **{k: kept[k] for k in kept.files if k != "torn"})
    assert len(load(Body, tmp_path / "before.npz").torn) == 0
    with pytest.raises(Problem, match="torn has shape"):
        replace(body, torn=np.zeros((3, 2)))
