"""Tissue that is never let go is simulated no stiffer than its pulls ask for: the same shapes in fewer steps."""

from dataclasses import replace

import numpy as np
import pytest
from slab import pulled
from slab_clip import FPS, QUICK, TRUE, T, clip, silent

from surgisim.artifacts.motion import Motion
from surgisim.config.estimation import Estimation
from surgisim.estimation.fit import estimate
from surgisim.estimation.gauss_newton import derivative
from surgisim.estimation.observation import observe
from surgisim.estimation.rounds import at_ease, hurry
from surgisim.estimation.search import PRIOR_LOG, search
from surgisim.estimation.trial import Trial
from surgisim.mpm.setup import prepare


def slowly(last: int = T) -> Motion:
    """A grip carried for most of the clip, and let go after frame `last`."""
    s = np.clip(np.arange(T) / 18, 0, 1)
    s = s * s * (3 - 2 * s)
    motion = pulled(frames=T, hold=last)
    return replace(motion, position=motion.center_rest[:, None] + s[:, None] * np.array([0.003, 0.0, -0.006]))


BODY, _, TRACKS, *_, CAMERA = SEEN = clip(motion=slowly())


def trial(motion: Motion, terms=("corotated", "newtonian"), gravity=(0.0, 0.0, 0.0)) -> Trial:
    made = prepare(BODY, terms, density=1050.0, gravity=gravity, grips=motion)
    seen = observe(TRACKS, motion, CAMERA, made.simulator, floor=3e-5)
    held = BODY.rest[:, 2] > 0.075
    return Trial([made] * 2, search(list(terms), {}, []), motion, seen, held, FPS, T, np.arange(1, T), firm=False)


def test_a_slow_pull_gives_the_same_shapes_in_fewer_steps():
    full = trial(slowly())
    eased, x = at_ease(full), full.wanted.start
    assert eased.eased == -hurry(full, x) < -0.5
    assert eased.per_frame(eased.values(x)) < 0.8 * full.per_frame(full.values(x))
    one, other = (t.run(x).u[1:] for t in (full, eased))
    assert np.linalg.norm(one - other) < 0.01 * np.linalg.norm(one)


def test_what_makes_no_difference_is_not_asked_about():
    eased = at_ease(trial(slowly()))
    x, asked = eased.wanted.start, []

    def together(xs):
        asked.extend(xs)
        return eased.together(xs)

    J = derivative(together, x, eased.residual(x), eased.differences, eased.wanted.bounds)
    idle = eased.wanted.paces
    assert idle.sum() == 2
    assert len(asked) == (~idle).sum()
    assert not J[:, idle].any()
    assert J[:, ~idle].any(0).all()
    assert np.array_equal(eased.residual(x), eased.residual(x + 0.5 * idle))


def test_a_release_a_weight_or_a_memory_is_not_eased():
    assert at_ease(trial(slowly(last=20))).eased is None
    assert at_ease(trial(slowly(), gravity=(0.0, 0.0, 9.81))).eased is None
    assert at_ease(trial(slowly(), terms=("corotated", "newtonian", "relaxation"))).eased is None
    quick = trial(slowly())
    quick = replace(quick, motion=replace(quick.motion, position=quick.motion.position[:, np.arange(T) * T // 2 % T]))
    assert at_ease(quick).eased is None


def test_what_is_never_told_keeps_its_prior():
    _, physics, fit, *_ = estimate(*SEEN, Estimation(**QUICK), silent)
    E, nu = (fit.identifiability[f"corotated.{name}"] for name in ("E", "nu"))
    assert not E["told"]
    assert np.log(E["high"] / E["low"]) == pytest.approx(2 * 1.645 * PRIOR_LOG, rel=0.02)
    assert nu["low"] < TRUE["corotated"]["nu"] < nu["high"]
    assert physics.terms["corotated"]["E"]["value"] == pytest.approx(3000.0)
    assert fit.held_out["fitted"] < 0.5 * fit.held_out["default"]


def test_a_field_is_found_at_ease_and_brought_back():
    case = clip(motion=slowly(), stiff=lambda rest: np.where(rest[:, 0] < 0, 3.0, 1.0))
    settings = QUICK | {"field_iterations": 5, "iterations": 2}
    material, _, fit, *_ = estimate(*case, Estimation(**settings), silent)
    assert fit.held_out["field_kept"]
    E = material.values[:, list(material.names).index("corotated.E")]
    assert np.median(E) == pytest.approx(3000.0, rel=0.5)
    assert E.max() > 1.2 * E.min()
