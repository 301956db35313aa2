"""A silicone beam's swings, fitted on one take, predict another."""

import numpy as np
import pytest

from surgisim.recordings.folder import read_recording, write_recording
from surgisim.verification import silicone_beam
from surgisim.verification.ringing import ringing
from surgisim.verification.silicone_take import take


@pytest.fixture(scope="module")
def result(shared):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SURGISIM_DATA", str(shared / "data"))
        return silicone_beam.measure(lambda done, total, text: None, quick=True)


@pytest.mark.shared
def test_take_b_is_predicted_from_take_a(result):
    other = result["takes"]["b"]
    assert abs(other["frequency_error"]) < 0.03
    assert abs(other["decay_error"]) < 0.15
    assert other["apart"] < 0.15 * other["motion"]


@pytest.mark.shared
def test_the_fit_finds_take_a(result):
    own = result["takes"]["a"]
    assert abs(own["frequency_error"]) < 0.005
    assert abs(own["decay_error"]) < 0.03


@pytest.mark.shared
def test_its_page_can_be_drawn_and_written(result):
    assert len(silicone_beam.draw(result).axes) == 4
    assert "| b (predicted) |" in silicone_beam.words(result)


@pytest.mark.shared
def test_the_held_beam_is_where_its_makers_say(shared):
    for name in "ab":
        recording = take(shared / "data" / "silicone_beam_mocap" / f"beam_gravity_V2_{name}.c3d")
        assert recording.mesh.volume == pytest.approx(9e-5, rel=1e-6)
        assert np.abs(recording.attached() - [[0.036, 0.015, 0], [0.024, -0.006, 0], [0.006, 0.036, 0]]).max() < 0.001
        assert np.linalg.norm(recording.points[:, 1] - recording.points[:, 0], axis=1).min() > 0.0002
        held = recording.body(0.01).held
        assert held.sum() == 36


@pytest.mark.shared
def test_a_take_becomes_a_folder(shared, tmp_path):
    made = take(shared / "data" / "silicone_beam_mocap" / "beam_load52_V2_a.c3d")
    write_recording(made, tmp_path)
    read = read_recording(tmp_path)
    assert (read.starts, read.gravity, read.density) == ("released", made.gravity, 1070.0)
    np.testing.assert_array_equal(read.points, made.points)


def test_frequency_and_decay_are_read_from_under_a_creeping_midline():
    t = np.arange(200) / 100
    y = 2 * np.exp(-2.5 * t) * np.cos(2 * np.pi * 7.7 * t + 1) + 0.5 * np.exp(-t / 0.4) + 0.1
    read = ringing(y, 100.0, begin=0.1, end=1.6, frequency=7.0)
    assert read.frequency == pytest.approx(7.7, rel=2e-4)
    assert read.decay == pytest.approx(2.5, rel=5e-3)
    assert read.loss == pytest.approx(2.5 / np.pi / 7.7, rel=5e-3)
    assert np.abs(read.midline(t[10:160]) - 0.5 * np.exp(-t[10:160] / 0.4) - 0.1).max() < 0.05 * 0.5
