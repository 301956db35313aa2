"""What a body cannot bear gives way, and what is handed on bears its clip with a margin."""

import dataclasses

import numpy as np
import pytest
from slab import pulled, slab
from slab_clip import FPS, TRUE, T

from surgisim.estimation import bearing
from surgisim.estimation.bearing import GRIPS, SQUEEZED, YIELDS, borne, handed_on
from surgisim.estimation.finer import on_finer_grid
from surgisim.estimation.search import search
from surgisim.estimation.trial import Trial
from surgisim.mpm.carried import Carried
from surgisim.mpm.setup import SKIN, prepare
from surgisim.mpm.simulator import Run
from surgisim.problem import Problem


def settled(farther: float) -> tuple[Trial, np.ndarray]:
    """A trial of a slab that is pulled so many times farther, and its parameters (P, M)."""
    body, motion = slab(), pulled(frames=T, hold=9)
    way = motion.position - motion.center_rest[:, None]
    motion = dataclasses.replace(motion, position=motion.center_rest[:, None] + farther * way)
    made = prepare(body, tuple(TRUE), density=1050.0, grips=motion, skin=SKIN)
    wanted = search(list(TRUE), {}, [])
    trial = Trial([made], wanted, motion, None, body.held, FPS, T, np.arange(1, T), firm=False)
    return trial, trial.theta(wanted.values(wanted.start))


def start(trial: Trial) -> dict:
    return trial.wanted.values(trial.wanted.start)


def least(trial: Trial, run: Run) -> float:
    body = trial.bodies[0]
    particles = Carried(body.body.rest, body.simulator)
    return min(float(np.linalg.det(particles.at(u)[1]).min()) for u in run.u)


def test_a_grip_that_squeezes_nothing_flat_stays_firm():
    trial, theta = settled(1.0)
    history = []
    chosen, run = handed_on(trial, start(trial), theta, history)
    assert chosen.grip == 1.0
    assert least(chosen, run) > SQUEEZED
    assert history == []


def test_one_that_squeezes_tissue_too_far_gives_way_a_little(monkeypatch):
    trial, theta = settled(3.0)
    firm, run = handed_on(trial, start(trial), theta, [])
    bound, history = least(firm, run) + 0.02, []
    monkeypatch.setattr(bearing, "SQUEEZED", bound)
    chosen, run = handed_on(trial, start(trial), theta, history)
    assert 0.3 < chosen.grip < 1.0
    assert least(chosen, run) >= bound
    assert "of its volume" in history[0]["broke"]


def test_one_that_turns_tissue_inside_out_gives_way_until_none_does():
    trial, theta = settled(6.0)
    history = []
    chosen, run = handed_on(trial, start(trial), theta, history)
    assert chosen.grip < 1.0
    assert least(chosen, run) >= SQUEEZED
    assert "inside out" in history[0]["broke"]


def test_a_pull_that_no_grip_bears_is_refused():
    trial, theta = settled(40.0)
    history = []
    with pytest.raises(Problem, match="however softly"):
        handed_on(trial, start(trial), theta, history)
    assert history[-1]["share"] < GRIPS[-1] / YIELDS


def test_a_finer_grid_that_does_not_bear_the_grip_is_left(monkeypatch):
    """Held as on the wider grid, not softer; a field is brought along as it is beside the uniform parameters."""
    trial, theta = settled(3.0)
    values, history, field = start(trial), [], theta.copy()
    field[: len(field) // 2] *= 1.1
    coarse = dataclasses.replace(trial, grip=0.8)
    fine, there, run = on_finer_grid(trial, values, coarse, values, field, history)
    assert fine.grip == 0.8
    np.testing.assert_allclose(there, field)
    assert history == []
    monkeypatch.setattr(bearing, "SQUEEZED", least(fine, run) + 0.02)
    assert on_finer_grid(trial, values, coarse, values, field, history) is None
    assert [(row["round"], row["cost"]) for row in history] == [("finer grid", None)]


def run_into_one_another(trial: Trial, farther: float) -> Trial:
    """The trial with three patches along its edge, far from the grip, of which one is carried through the next."""
    rest = trial.bodies[0].body.rest
    (left, top, z), (right, bottom, _) = rest.min(0), rest.max(0)
    apart = 0.3 * (bottom - top)
    rim = np.repeat(np.array([[left, top, z], [left, top + apart, z], [right, bottom, z]])[:, None], T, axis=1)
    rim[0, :, 1] += np.linspace(0.0, farther * apart, T)
    motion = dataclasses.replace(trial.motion, rim=rim, rim_radius=np.full(3, 0.2 * apart))
    return dataclasses.replace(trial, motion=motion)


@pytest.mark.parametrize("hands_on", [True, False], ids=["handed on", "on the way"])
def test_of_what_squeezes_tissue_the_nearest_gives_way(hands_on):
    """A grip that squeezes nothing stays as firm as it was."""
    trial, theta = settled(1.0)
    trial = run_into_one_another(trial, 3.0 if hands_on else 6.0)
    x, history = trial.wanted.start, []
    chosen, run = handed_on(trial, start(trial), theta, history) if hands_on else borne(trial, x, history)
    assert chosen.grip == 1.0
    assert len(history) == 1
    np.testing.assert_array_equal(chosen.motion.rim[-1], trial.motion.rim[-1])
    assert len(chosen.motion.rim) == 2
    assert least(chosen, run) >= SQUEEZED


def test_where_nothing_is_left_to_give_way_the_clip_is_refused():
    trial, _ = settled(40.0)
    history = []
    with pytest.raises(Problem, match="however softly"):
        borne(run_into_one_another(trial, 0.0), trial.wanted.start, history)
    assert {h["share"] for h in history} == set(GRIPS)
