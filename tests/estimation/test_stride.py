"""A search's runs take longer steps where that changes nothing, and a pull is judged once it has shown its shape."""

from dataclasses import replace

import numpy as np
import pytest
from slab import pulled, slab
from slab_clip import FPS, TRUE, T

from surgisim.estimation.observation import phases
from surgisim.estimation.rounds import FAR, _driven, _shown
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
    longer = trial.striding(x)
    assert longer.stride == STRIDES[0]
    stable, quick = trial.run(x).u, longer.run(x).u
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
    assert trial.striding(x).stride == 1.0
    assert np.array_equal(replace(trial, stride=STRIDES[0]).run(x).u, stable)


def test_where_it_shakes_it_is_not_taken(trial, monkeypatch):
    broken(monkeypatch, lambda found: (replace(found[0], u=1.05 * found[0].u), found[1]))
    assert trial.striding(trial.wanted.start).stride == 1.0


def test_a_pull_has_shown_its_shape_once_it_has_gone_its_way(trial):
    phase = phases(trial.motion, T)
    way = np.linalg.norm(trial.motion.position[0] - trial.motion.center_rest[0], axis=-1)
    shown = _shown(trial, phase)
    assert way[shown - 1] < FAR * way.max() <= way[shown]
    assert shown < _driven(trial, phase)
    every_third = replace(trial, fitted=np.arange(1, T, 3))
    assert _shown(every_third, phase) in every_third.fitted
    assert _shown(every_third, phase) >= shown
