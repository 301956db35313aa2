"""A search's runs take longer steps where that changes nothing, and a pull is judged once it has shown its shape."""

from dataclasses import replace

import numpy as np
import pytest
from slab import pulled, slab
from slab_clip import FPS, TRUE, T

from surgisim.estimation.observation import phases
from surgisim.estimation.rounds import FAR, LAGS, _shown, last_driven
from surgisim.estimation.search import search
from surgisim.estimation.trial import SAME, STRIDES, Trial
from surgisim.mpm.setup import SKIN, prepare
from surgisim.mpm.simulator import Breakdown


@pytest.fixture(scope="module")
def trial():
    body, motion = slab(), pulled(frames=T, hold=9)
    made = prepare(body, tuple(TRUE), density=1050.0, grips=motion, skin=SKIN)
    return Trial([made], search(list(TRUE), {}, []), motion, None, body.held, FPS, T, np.arange(1, T), firm=False)


def test_a_longer_step_is_taken_where_the_run_is_the_same(trial):
    x = trial.wanted.start
    longer, stable = trial.striding(x)
    assert longer.stride == STRIDES[0]
    stable, quick = stable.u, longer.run(x).u
    np.testing.assert_array_equal(stable, trial.run(x).u)
    assert 0 < np.linalg.norm(quick - stable) <= SAME * np.linalg.norm(stable)


def broken(monkeypatch, instead):
    at = Trial._at_stride

    def run(self, stride, *rest):
        return instead(at(self, stride, *rest)) if stride > 1 else at(self, stride, *rest)

    monkeypatch.setattr(Trial, "_at_stride", run)


def test_where_it_breaks_the_stable_step_is_taken(trial, monkeypatch):
    x = trial.wanted.start
    stable = trial.run(x).u

    def torn(_):
        raise Breakdown("turned inside out")

    broken(monkeypatch, torn)
    assert trial.striding(x)[0].stride == 1.0
    assert np.array_equal(replace(trial, stride=STRIDES[0]).run(x).u, stable)


def test_where_it_shakes_it_is_not_taken(trial, monkeypatch):
    broken(monkeypatch, lambda found: (replace(found[0], u=1.05 * found[0].u), found[1]))
    assert trial.striding(trial.wanted.start)[0].stride == 1.0


def test_a_pull_has_shown_its_shape_once_it_has_gone_its_way(trial):
    held_on = replace(trial, motion=pulled(frames=T, hold=T))
    way = np.linalg.norm(held_on.motion.position[0] - held_on.motion.center_rest[0], axis=-1)
    far = int(np.argmax(way >= FAR * way.max()))
    assert _shown(held_on, phases(held_on.motion, T)) == far + LAGS < T - 1
    every_third = replace(held_on, fitted=np.arange(1, T, 3))
    shown = _shown(every_third, phases(held_on.motion, T))
    assert shown in every_third.fitted
    assert far + 3 * LAGS <= shown < far + 3 * (LAGS + 1)


def test_what_comes_after_a_release_is_no_pull(trial):
    phase = phases(trial.motion, T)
    assert _shown(trial, phase) <= last_driven(trial, phase)
    never = replace(trial, fitted=np.arange(12, T))
    assert _shown(never, phase) == last_driven(never, phase) == 0


def test_a_misfit_asks_for_no_frame_after_those_it_compares_but_a_step_bears_the_whole_clip(trial, monkeypatch):
    seen, until, at = replace(trial, fitted=np.arange(1, 9)), [], Trial._at_stride

    def run(self, stride, x, worker, last):
        until.append(last)
        return at(self, stride, x, worker, last)

    monkeypatch.setattr(Trial, "_at_stride", run)
    monkeypatch.setattr(Trial, "judged", lambda self, u, observation, last: u)
    x = trial.wanted.start
    assert len(seen.residual(x)) == 9
    assert len(seen.residual(x, last=4)) == 5
    assert len(seen.striding(x, last=8)[1].u) == T
    assert len(seen.striding(x, last=4)[1].u) == 5
    assert until == [8, 4, None, None, 4, 4]
