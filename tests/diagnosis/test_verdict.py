"""Plant a law, and the diagnosis names it; plant nothing, and it names nothing."""

from dataclasses import replace

import numpy as np
import pytest
from planted import GRID, SLOWLY, TILT, case_of, memo_of, recording, tilted

from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis import calibration, judgement
from surgisim.diagnosis import diagnose as diagnosing
from surgisim.diagnosis import verdict as judging
from surgisim.diagnosis.calibration import CLEAR, THRESHOLD
from surgisim.diagnosis.diagnose import diagnose, refit
from surgisim.diagnosis.evidence import Finding
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.nuisance import FINER
from surgisim.diagnosis.prospect import SHOWS, Gain
from surgisim.physics.place import Place

SETTINGS = Diagnosing(grid=GRID, replay=GRID, nulls=8, experiment=False, free=0, residual=False)
WORSE = Gain(-50.0, -80.0, -20.0, 60.0)


def verdict(settings=SETTINGS, **planted):
    made = recording(**planted, fps=SLOWLY)
    return diagnose(made, settings, lambda *_: None, memo_of(made))


@pytest.fixture(scope="module")
def leaning():
    return verdict(values=TILT)


@pytest.fixture(scope="module")
def bare():
    return verdict()


def test_a_change_of_weight_is_named(leaning):
    found, physics, _ = leaning
    assert found.verdict == "named"
    assert found.effects[0]["term"] == "gravity"
    assert found.effects[0]["probability"] > 0.5
    x = found.effects[0]["parameters"]["x"]
    assert x["low"] < 8.0 < x["high"]
    assert physics.terms["gravity"]["x"]["value"] == pytest.approx(x["value"])
    # Weight that acts all along is a constant of each point wherever the tissue hangs freely, and where the base stays
    # as it is (free=0) too much of it is taken: plain errors do not fall, the likelihood does.
    assert found.global_test["gain"] > 2 * THRESHOLD
    assert found.global_test["held_out"]["expected"] < SHOWS
    assert found.words.endswith("The frames held out cannot show it.")


def test_a_law_that_its_placebo_beats_on_held_out_frames_is_neither_named_nor_modelled(monkeypatch):
    judged = judging.judged

    def beaten(case, laws, tried, over=None, worse=False):
        return judged(case, laws, tried, None if over is None else WORSE, worse)

    monkeypatch.setattr(judging, "judged", beaten)
    found, physics, _ = verdict(values=TILT)
    assert found.verdict == "unexplained"
    assert found.global_test["reason"] == "beaten"
    assert found.effects[0]["probability"] < 0.5
    assert "gravity" not in physics.terms
    assert found.fit["after"] == found.fit["before"]
    assert "a wrong law, foretells the frames held out better" in found.words


def test_a_law_with_which_the_frames_held_out_are_farther_off_is_not_named(monkeypatch):
    monkeypatch.setattr(judging, "worse", lambda case, shown: True)
    found, physics, _ = verdict(values=TILT)
    assert (found.verdict, found.fit["after"]) == ("unexplained", found.fit["before"])
    assert found.global_test["reason"] == "refuted"
    assert found.effects[0]["probability"] < 0.5
    assert "gravity" not in physics.terms


@pytest.mark.slow(85)
def test_nuisances_larger_than_they_ever_are_are_something_hidden(bare, monkeypatch):
    found, *_ = bare
    assert found.global_test["nuisance_ratio"] < 1.0
    case = case_of(recording(fps=SLOWLY))
    assert case.nuisance_ratio == pytest.approx(found.global_test["nuisance_ratio"], rel=1e-3)
    columns = case.space.columns
    for size, strained in ((1.0, False), (3.0, True)):
        values = size * np.random.default_rng(0).standard_normal(columns.shape[1])
        pushed = replace(case, z=case.z + columns @ values)
        assert pushed.overstretched == strained
        assert not replace(pushed, settings=SETTINGS.model_copy(update={"calibrated": False})).overstretched
    monkeypatch.setattr(calibration, "OVERSTRETCHED", 0.0)
    monkeypatch.setattr(diagnosing, "unheard", lambda *_: [])
    # Recorded on the grid that runs are compared with: the coarse one's own error is not tissue's.
    settings = SETTINGS.model_copy(update={"refine": 1, "second": False})
    said, physics, _ = verdict(settings, share=FINER * GRID)
    assert (said.verdict, set(physics.terms)) == ("unexplained", {"neo_hookean_ciarlet", "newtonian"})
    assert said.unexplained_fraction > 0.8
    # A replay's grid that is no finer is none to look at again.
    assert 1e-3 * said.global_test["spacing"]["value"] == pytest.approx(case.clip.body.spacing)


def test_nothing_planted_is_nothing_named(bare):
    found, physics, _ = bare
    assert found.verdict == "nothing detectable"
    assert not found.effects
    assert set(physics.terms) == {"neo_hookean_ciarlet", "newtonian"}
    assert found.detectable_above["value"] > 0


def test_what_shows_only_in_the_frames_held_out_is_said(bare, monkeypatch):
    assert "held out" not in bare[0].words
    monkeypatch.setattr(judging, "rms", lambda *_: (0.3, 9.9))
    found, _, _ = verdict()
    assert found.verdict == "nothing detectable"
    assert "in those held out by 9.9 mm" in found.words


def test_a_law_that_no_plain_error_bears_out_is_not_named_nor_detectable_unless_it_is_clear(leaning, monkeypatch):
    assert leaning[0].effects[0]["log_evidence"] > CLEAR
    monkeypatch.setattr(judgement, "borne_out", lambda *_: 0.1)
    found = verdict(values=TILT)[0]
    assert (found.verdict, found.global_test["reason"]) == ("unexplained", "unbacked")
    monkeypatch.setattr(calibration, "CLEAR", 1e9)
    found, physics, _ = verdict(values=TILT)
    assert found.verdict == "nothing detectable"
    assert not found.effects
    assert "gravity" not in physics.terms
    assert found.ranking[0]["probability"] <= 0.05
    assert found.words.startswith("Simulation and recording differ by no more than noise")


def test_nulls_stay_below_the_threshold(bare, leaning):
    assert max(*bare[0].global_test["nulls"], *leaning[0].global_test["nulls"]) < THRESHOLD


def test_the_mismatch_covers_every_point_frame_and_particle(leaning):
    _, _, mismatch = leaning
    assert mismatch.z.shape == mismatch.residual_before.shape[:2]
    assert mismatch.cause.shape == (len(mismatch.particles),)
    assert mismatch.cause.min() >= 0
    assert mismatch.cause.max() == pytest.approx(1.0)
    assert np.isfinite(mismatch.residual_after[np.isfinite(mismatch.residual_before)]).all()


def test_a_place_outside_the_body_is_no_law_of_the_clip():
    h = Hypothesis("hidden_contact", np.eye(3), 0, Place((0.2, 0.2, 0.2), 0.002), 0.2, 0.6)
    outside = Finding(h, 9.0, np.array([0.1, 0.0, 0.0]), np.zeros(3), 20.0, np.zeros(1), 0, 1e-4)
    case = tilted()
    assert refit(case, outside, 9.0, case.z).log_evidence == -np.inf
