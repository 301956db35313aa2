"""A hypothesis means the same in the engine's numbers as in the search's."""

import numpy as np
import pytest
from planted import GRID, recording

from surgisim.diagnosis.clip import clip_of
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.laws import SPHERE, law_of, stiffness_of
from surgisim.physics.catalogue import choose
from surgisim.physics.terms.active_contraction import spread, twin_wave


@pytest.fixture(scope="module")
def clip():
    return clip_of(recording(), share=GRID)


@pytest.mark.parametrize("s", [0.2, 0.7, 1.5, 6.0])
def test_a_lump_answers_as_a_sphere_does(s):
    assert stiffness_of((s - 1) / (1 + SPHERE * (s - 1))) == pytest.approx(s)


@pytest.mark.parametrize("start", [0.0, 0.9])
def test_waves_keep_their_phase_and_start_from_rest(clip, start):
    about = {"period": 1.2, "wavelength": 0.04, "axis": np.array([0.8, 0.6, 0.0]), "phase": 2.0}
    h = Hypothesis("active_contraction", np.ones((1, 1)), 1, None, start, None, about)
    numbers = law_of(h, np.array([200.0]), clip).values["active_contraction"]
    numbers.pop("tension")
    rest = clip.body.rest.astype(float)
    onset = spread(rest, **numbers)["onset"]
    late = 6.0
    turns = 2 * np.pi * late / 1.2 + 2.0 - 2 * np.pi / 0.04 * ((rest - rest.mean(0)) @ about["axis"])
    assert np.allclose(twin_wave(late, onset, 1.2, 0.5), np.maximum(np.sin(turns), 0) ** 2, atol=1e-6)
    before = twin_wave(0.0, onset, 1.2, 0.5)
    assert (before == 0).all() if start else before.max() > 0.5


def test_a_push_keeps_its_direction(clip):
    force = np.array([0.1, -0.3, 0.2])
    h = Hypothesis("gravity", np.eye(3), 0, None, 0.0)
    law = law_of(h, force, clip).values["gravity"]
    assert [law[k] for k in "xyz"] == pytest.approx(force.tolist())
    assert set(choose(["gravity"])["gravity"].params) == {*law}
