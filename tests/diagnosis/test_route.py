"""The case decides whether a tangent or the engine answers for a body."""

from dataclasses import replace

import numpy as np
import pytest
from planted import GRID, TRUE, block, recording

from surgisim.artifacts.diagnosis import Diagnosis
from surgisim.artifacts.physics import Physics
from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis import route
from surgisim.diagnosis.memo import NOTHING_KEPT
from surgisim.problem import Problem
from surgisim.recordings.recording import no_grips

SETTINGS = Diagnosing(grid=GRID)


@pytest.fixture
def asked(monkeypatch):
    """Which way was taken."""
    said = []
    base = {"E": {"value": float(np.exp(TRUE[0]))}, "nu": {"value": 0.44}}
    verdict = Diagnosis("r", "named", [{"term": "gravity"}], [], {}, [], {}, {}, 0.0, "Something.", base, {}, {})
    numbers = {"E": {"value": base["E"]["value"], "unit": "Pa"}, "nu": {"value": 0.44, "unit": "1"}}
    weight = {k: {"value": v, "unit": "m/s^2"} for k, v in (("x", 8.0), ("y", 0.0), ("z", 0.0))}
    terms = {"neo_hookean_ciarlet": numbers, "gravity": weight | {"onset": {"value": -1.0, "unit": "s"}}}
    physics = Physics(terms, 1050.0, [0.0] * 3, {"spacing": 0.005, "step": 1e-4})

    def by_tangent(*_):
        said.append("tangent")
        return verdict, physics, None

    def by_engine(seen, held_out, *_):
        said.append(f"engine, {len(seen)} and {held_out}")
        return verdict, physics, None

    monkeypatch.setattr(route, "diagnose", by_tangent)
    monkeypatch.setattr(route, "diagnose_swinging", by_engine)
    return said


def diagnosed(*seen, held_out=None, settings=SETTINGS):
    return route.diagnose_body(seen, held_out, settings, lambda *_: None, NOTHING_KEPT)


def test_pulled_tissue_is_answered_for_by_a_tangent_and_a_body_let_go_by_the_engine(asked):
    pulled = recording()
    found = diagnosed(pulled)[0]
    assert asked == ["tangent"]
    assert found.global_test["responses"]["used"] == "tangent"
    let_go = replace(pulled, fps=200.0, starts="released", motion=no_grips(pulled.frames))
    diagnosed(let_go, let_go)
    assert asked[-1] == "engine, 2 and None"


def test_several_recordings_and_an_elastic_base_are_for_bodies_that_swing(asked):
    pulled = recording()
    with pytest.raises(Problem, match="each with --base of the one before"):
        diagnosed(pulled, pulled)
    with pytest.raises(Problem, match="'elastic' is for bodies that swing or hang"):
        diagnosed(pulled, settings=Diagnosing(grid=GRID, base="elastic"))


def test_a_recording_held_out_is_foretold_with_and_without_what_is_named(asked, monkeypatch):
    pulled = recording()
    course = np.linspace(0, 2e-3, pulled.frames)[None, :, None] * np.array([1.0, 0, 0])
    other = replace(pulled, name="other", points=(pulled.place[:, None] + course).astype(np.float32))

    def simulate(clip, values, places, frames):
        return np.repeat(course[:, :frames] * ("gravity" in values), len(clip.kept), 0)

    monkeypatch.setattr(route, "simulate", simulate)
    found = diagnosed(pulled, held_out=other)[0]
    assert found.foretold["before"] == pytest.approx(2.0 / np.sqrt(3), rel=0.05)
    assert found.foretold["after"] == pytest.approx(0.0, abs=1e-3)
    assert "Recording other, which was never fitted" in found.words
    with pytest.raises(Problem, match=r"their rest\.ply differ"):
        diagnosed(pulled, held_out=replace(other, mesh=replace(block(), vertices=1.1 * block().vertices)))
