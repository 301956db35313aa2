"""What an estimation hands on can be simulated elsewhere: no tissue of it is all but inside out."""

import dataclasses

import numpy as np
import pytest
from slab import pulled, slab
from slab_clip import FPS, TRUE, T

from surgisim.estimation import handed_on as margin
from surgisim.estimation.handed_on import SQUEEZED, YIELDS, handed_on
from surgisim.estimation.rounds import GRIPS
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


def least(trial: Trial, run: Run) -> float:
    body = trial.bodies[0]
    particles = Carried(body.body.rest, body.simulator)
    return min(float(np.linalg.det(particles.at(u)[1]).min()) for u in run.u)


def test_a_grip_that_squeezes_nothing_flat_stays_firm():
    trial, theta = settled(1.0)
    history = []
    chosen, run = handed_on(trial, trial.wanted.start, theta, history)
    assert chosen.grip == 1.0
    assert least(chosen, run) > SQUEEZED
    assert history == []


def test_one_that_squeezes_tissue_too_far_gives_way_a_little(monkeypatch):
    trial, theta = settled(3.0)
    firm, run = handed_on(trial, trial.wanted.start, theta, [])
    bound, history = least(firm, run) + 0.02, []
    monkeypatch.setattr(margin, "SQUEEZED", bound)
    chosen, run = handed_on(trial, trial.wanted.start, theta, history)
    assert 0.3 < chosen.grip < 1.0
    assert least(chosen, run) >= bound
    assert "of its volume" in history[0]["broke"]


def test_one_that_turns_tissue_inside_out_gives_way_until_none_does():
    trial, theta = settled(6.0)
    history = []
    chosen, run = handed_on(trial, trial.wanted.start, theta, history)
    assert chosen.grip < 1.0
    assert least(chosen, run) >= SQUEEZED
    assert "inside out" in history[0]["broke"]


def test_a_pull_that_no_grip_bears_is_refused():
    trial, theta = settled(40.0)
    history = []
    with pytest.raises(Problem, match="however softly"):
        handed_on(trial, trial.wanted.start, theta, history)
    assert history[-1]["share"] < GRIPS[-1] / YIELDS


def test_of_what_squeezes_tissue_the_nearest_gives_way():
    """Two patches of the edge run into one another, far from a grip that squeezes nothing."""
    trial, theta = settled(1.0)
    rest = trial.bodies[0].body.rest
    low, high = rest.min(0), rest.max(0)
    at = np.array([[low[0], low[1], low[2]], [low[0], low[1] + 0.3 * (high[1] - low[1]), low[2]], [*high[:2], low[2]]])
    rim = np.repeat(at[:, None], T, axis=1)
    rim[0, :, 1] += np.linspace(0.0, 3.0 * (at[1, 1] - at[0, 1]), T)
    motion = dataclasses.replace(trial.motion, rim=rim, rim_radius=np.full(3, 0.2 * (at[1, 1] - at[0, 1])))
    history = []
    chosen, run = handed_on(dataclasses.replace(trial, motion=motion), trial.wanted.start, theta, history)
    assert chosen.grip == 1.0
    assert len(history) == 1
    assert len(chosen.motion.rim) == 2
    np.testing.assert_allclose(chosen.motion.rim[-1], rim[-1])
    assert least(chosen, run) >= SQUEEZED
