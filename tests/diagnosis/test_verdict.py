"""Plant a law, and the diagnosis names it; plant nothing, and it names nothing."""

from dataclasses import replace

import numpy as np
import pytest
from planted import GRID, recording

from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis import calibration
from surgisim.diagnosis import verdict as judging
from surgisim.diagnosis.calibration import CLEAR, THRESHOLD
from surgisim.diagnosis.clip import clip_of
from surgisim.diagnosis.diagnose import diagnose, prepare_case, refit
from surgisim.diagnosis.evidence import Finding
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.memo import Memo
from surgisim.physics.place import Place

SETTINGS = Diagnosing(grid=GRID, nulls=8, experiment=False, free=0)


TILT = {"gravity": {"x": 8.0, "y": 0.0, "z": 0.0, "onset": -1.0}}


def verdict(memory=None, settings=SETTINGS, **planted):
    return diagnose(recording(**planted), settings, lambda *_: None, Memo(memory, ""))


@pytest.fixture(scope="module")
def memory(tmp_path_factory):
    return tmp_path_factory.mktemp("runs")


@pytest.fixture(scope="module")
def tilted(memory):
    return verdict(memory, values=TILT)


@pytest.fixture(scope="module")
def nothing(tmp_path_factory):
    return tmp_path_factory.mktemp("nothing")


@pytest.fixture(scope="module")
def plain(nothing):
    return verdict(nothing)


def test_a_change_of_weight_is_named(tilted):
    found, physics, _ = tilted
    assert found.verdict == "named"
    assert found.effects[0]["term"] == "gravity"
    assert found.effects[0]["probability"] > 0.5
    x = found.effects[0]["parameters"]["x"]
    assert x["low"] < 8.0 < x["high"]
    assert physics.terms["gravity"]["x"]["value"] == pytest.approx(x["value"])
    assert found.fit["after"] < found.fit["before"]
    assert found.fit["after"] < found.fit["placebo"]


def test_a_law_that_its_placebo_beats_on_held_out_frames_is_neither_named_nor_modelled(tilted, memory, monkeypatch):
    monkeypatch.setattr(judging, "over_placebo", lambda case, shown: -1e-3)
    found, physics, _ = verdict(memory, values=TILT)
    assert found.verdict == "unexplained"
    assert found.effects[0]["probability"] < 0.5
    assert "gravity" not in physics.terms
    assert found.fit["after"] == found.fit["before"]
    assert "a placebo foretells the manipulation held out better" in found.words


def test_a_tie_with_a_placebo_is_no_defeat():
    shares = {"outward": None, "left": 0.0, "predicted": None}
    assert not judging.doubtful("gravity", {**shares, "over_placebo": None})
    assert not judging.doubtful("gravity", {**shares, "over_placebo": -0.9e-5})
    assert judging.doubtful("gravity", {**shares, "over_placebo": -1.1e-5})


def test_nuisances_larger_than_they_ever_are_are_something_hidden(nothing, plain, monkeypatch):
    found, *_ = plain
    assert found.global_test["strain"] < 1.0
    case = prepare_case(clip_of(recording(), share=GRID), SETTINGS, Memo(nothing, ""), lambda *_: None)
    assert case.strain == pytest.approx(found.global_test["strain"])
    columns = case.space.columns
    for size, strained in ((1.0, False), (3.0, True)):
        values = size * np.random.default_rng(0).standard_normal(columns.shape[1])
        pushed = replace(case, z=case.z + columns @ values)
        assert pushed.strained == strained
        assert not replace(pushed, settings=SETTINGS.model_copy(update={"calibrated": False})).strained
    monkeypatch.setattr(calibration, "STRAINED", 0.0)
    said, physics, _ = verdict(nothing, SETTINGS.model_copy(update={"replay": GRID}))
    assert (said.verdict, set(physics.terms)) == ("unexplained", {"neo_hookean_ciarlet", "newtonian"})
    assert said.unexplained_fraction > 0.8


def test_nothing_planted_is_nothing_named(plain):
    found, physics, _ = plain
    assert found.verdict == "nothing detectable"
    assert not found.effects
    assert set(physics.terms) == {"neo_hookean_ciarlet", "newtonian"}
    assert found.detectable_above["value"] > 0


def test_what_shows_only_in_the_frames_held_out_is_said(plain, nothing, monkeypatch):
    assert "held out" not in plain[0].words
    errors = judging.errors

    def late(*told):
        fit, held_out = errors(*told)
        return fit, held_out | {"before": 1.7 * held_out["noise_floor"]}

    monkeypatch.setattr(judging, "errors", late)
    found, _, _ = verdict(nothing)
    assert found.verdict == "nothing detectable"
    assert "in those held out by" in found.words


def test_a_law_that_takes_nothing_off_the_error_is_not_detectable_unless_its_evidence_is_clear(
    tilted, memory, monkeypatch
):
    assert tilted[0].global_test["log_evidence"] > CLEAR
    monkeypatch.setattr(judging, "taken", lambda *_: 0.1)
    assert verdict(memory, values=TILT)[0].verdict == "named"
    monkeypatch.setattr(judging.calibration, "CLEAR", 1e9)
    found, physics, _ = verdict(memory, values=TILT)
    assert found.verdict == "nothing detectable"
    assert not found.effects
    assert "gravity" not in physics.terms
    assert found.ranking[0]["probability"] <= 0.05
    assert found.words.startswith("Simulation and recording differ by no more than noise")
    uncalibrated = SETTINGS.model_copy(update={"calibrated": False})
    assert verdict(memory, uncalibrated, values=TILT)[0].verdict == "named"


def test_nulls_stay_below_the_threshold(plain, tilted):
    assert max(*plain[0].global_test["nulls"], *tilted[0].global_test["nulls"]) < THRESHOLD


def test_the_mismatch_covers_every_point_frame_and_particle(tilted):
    _, _, mismatch = tilted
    assert mismatch.z.shape == mismatch.residual_before.shape[:2]
    assert mismatch.cause.shape == (len(mismatch.particles),)
    assert mismatch.cause.min() >= 0
    assert mismatch.cause.max() == pytest.approx(1.0)
    assert np.isfinite(mismatch.residual_after[np.isfinite(mismatch.residual_before)]).all()


def test_a_place_outside_the_body_is_no_law_of_the_clip():
    case = prepare_case(clip_of(recording(), share=GRID), SETTINGS, Memo(None, ""), lambda *_: None)
    h = Hypothesis("hidden_contact", np.eye(3), 0, Place((0.2, 0.2, 0.2), 0.002), 0.2, 0.6)
    outside = Finding(h, 9.0, np.array([0.1, 0.0, 0.0]), np.zeros(3), 20.0, np.zeros(1), 0, 1e-4)
    assert refit(case, outside, 9.0, case.z).log_evidence == -np.inf
