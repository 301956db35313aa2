"""A hypothesis means the same in the engine's numbers as in the search's."""

import numpy as np
import pytest
from planted import GRID, recording

from surgisim.diagnosis import waves
from surgisim.diagnosis.candidates import respiration
from surgisim.diagnosis.clip import clip_of
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.inclusion import SPHERE, stiffness_of
from surgisim.diagnosis.laws import Clash, joined, law_of
from surgisim.physics.catalogue import choose
from surgisim.physics.place import Place
from surgisim.physics.terms.active_contraction import spread, twin_wave


@pytest.fixture(scope="module")
def clip():
    return clip_of(recording(), share=GRID)


@pytest.mark.parametrize("s", [0.2, 0.7, 1.5, 6.0])
def test_a_lump_answers_as_a_sphere_does(s):
    assert stiffness_of((s - 1) / (1 + SPHERE * (s - 1))) == pytest.approx(s)


@pytest.mark.parametrize("start", [0.0, 0.9])
def test_waves_keep_their_phase_and_start_from_rest(clip, start):
    about = {"period": 1.2, "duty": 0.5, "wavelength": 0.04, "axis": np.array([0.8, 0.6, 0.0]), "phase": 2.0}
    h = Hypothesis("active_contraction", np.ones((1, 1)), 1, None, start, None, about)
    numbers = law_of(h, np.array([200.0]), clip).values["active_contraction"]
    rest = clip.body.rest.astype(float)
    onset, begin = spread(rest, **numbers)["onset"], numbers["begin"]
    late = 6.0
    turns = 2 * np.pi * late / 1.2 + 2.0 - 2 * np.pi / 0.04 * ((rest - rest.mean(0)) @ about["axis"])
    assert np.allclose(twin_wave(late, onset, 1.2, 0.5, begin), np.maximum(np.sin(turns), 0) ** 2, atol=1e-6)
    assert twin_wave(start, onset, 1.2, 0.5, begin).max() < 0.03
    soon = start + 0.3
    turns = turns + 2 * np.pi * (soon - late) / 1.2
    assert np.allclose(twin_wave(soon, onset, 1.2, 0.5, begin), np.maximum(np.sin(turns), 0) ** 2, atol=0.03)


@pytest.mark.parametrize("duty", [0.35, 0.5, 1.0])
def test_a_phase_of_a_contraction_is_a_mix_of_its_first_two_harmonics(duty):
    time, period, phase = np.arange(4000) / 1000, 0.8, 0.9
    course = twin_wave(time, -phase / (2 * np.pi) * period, period, duty, -9.0)
    x = 2 * np.pi * time / period
    harmonics = np.stack([np.ones_like(x), np.sin(x), np.cos(x), np.sin(2 * x), np.cos(2 * x)])
    mine = waves.mix([1.25, period], 1, phase, duty)
    assert mine[1:5] == pytest.approx(0.0)
    assert mine[[0, 5, 6, 7, 8]] == pytest.approx(np.linalg.lstsq(harmonics.T, course, rcond=None)[0], abs=2e-3)
    if duty == 1.0:
        # What never rests has one harmonic alone.
        assert mine[[0, 5, 6, 7, 8]] @ harmonics == pytest.approx(course, abs=1e-6)


def test_a_push_keeps_its_direction(clip):
    force = np.array([0.1, -0.3, 0.2])
    h = Hypothesis("gravity", np.eye(3), 0, None, 0.0)
    law = law_of(h, force, clip).values["gravity"]
    assert [law[k] for k in "xyz"] == pytest.approx(force.tolist())
    assert set(choose(["gravity"])["gravity"].params) == {*law}


def test_two_laws_are_joined_unless_a_body_would_need_one_twice(clip):
    down, here = np.array([0.0, 0.0, -1.0]), Place((0.0, 0.0, 0.01), 0.003)
    weight = law_of(Hypothesis("added_mass", np.eye(1), 1, here, 0.3, None, {"down": down}), np.array([0.05]), clip)
    push = law_of(Hypothesis("hidden_contact", np.eye(3), 0, here, 0.3, 0.9), np.array([0.0, 0.1, 0.0]), clip)
    stiffer = law_of(Hypothesis("stiffening", np.eye(1), 1), np.array([2.0]), clip)
    both = joined([push, stiffer])
    assert set(both.values) == {"hidden_contact", "stiffening"}
    assert both.places == {"hidden_contact": here}
    with pytest.raises(Clash):
        joined([weight, push])


@pytest.mark.parametrize(("second", "times"), [(0.4, 1), (3.0, 2)])
def test_breath_with_a_larger_second_harmonic_is_one_twice_as_fast(clip, second, times):
    # Sine and cosine of each harmonic along x; the search counts the second by halves.
    parts = np.zeros((4, 3))
    parts[:, 0] = 6e-4, 8e-4, 2 * second * 8e-4, 2 * second * -6e-4
    numbers = law_of(Hypothesis("respiration", np.eye(12), 0, None, None, None, {"rate": 0.3}), parts.ravel(), clip)
    breath = numbers.values["respiration"]
    assert breath["period"] == pytest.approx(1 / (0.3 * times))
    assert breath["amplitude"] == pytest.approx(1e-3 * (second if times == 2 else 1))
    assert breath["second"] == pytest.approx(0.0 if times == 2 else second)
    waves = breath["amplitude"] * np.array([np.sin(breath["phase"]), np.cos(breath["phase"])])
    along = np.sign(np.sin(breath["yaw"])) or 1.0
    assert along * waves == pytest.approx([second * -6e-4, second * 8e-4] if times == 2 else [8e-4, 6e-4])


@pytest.mark.parametrize("harmonics", [1, 2])
def test_a_breath_of_one_harmonic_or_two_may_come_sooner(clip, harmonics):
    h = Hypothesis("respiration", np.eye(6 * harmonics), 0, None, None, None, {"rate": 0.4})
    parts = np.outer([6e-4, 8e-4, 1e-4, -2e-4][: 2 * harmonics], [0.0, 0.6, 0.8])

    def waves(h, parts) -> np.ndarray:
        """Both harmonics' sizes and phases, upwards."""
        told = law_of(h, parts, clip).values["respiration"]
        up = told["amplitude"] * np.sign(np.sin(told["pitch"]))
        return up * np.exp(1j * np.array([told["phase"], told["second_phase"]])) * [1.0, told["second"]]

    plain = waves(h, parts.ravel())
    assert np.abs(plain) == pytest.approx([1e-3, 0.0 if harmonics == 1 else 0.5e-4 * np.hypot(1, 2)])
    _, _, phase, *_ = respiration.turned(h, parts.ravel())
    sooner = waves(*phase.turn(h, parts.ravel(), 1.0, clip))
    assert sooner == pytest.approx(plain * np.exp(1j * respiration.MAY_TURN * np.array([1, 2])))
