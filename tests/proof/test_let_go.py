"""Which law a swinging body lacks: the one under which another take is predicted best."""

import dataclasses

import numpy as np
import pytest
from proof import made_up

from surgisim.proof.rigs import let_go
from surgisim.proof.rigs.let_go import Law, name
from surgisim.report.board.known import page

FPS = made_up.FPS


def swinging(decay: float, sag: float, amplitude: float, seed: int):
    """A take of points that ring down by `decay` [1/s] about a rest `sag` [m] lower."""
    take = made_up.recording(seed=seed)
    t = np.arange(take.frames) / FPS
    y = amplitude * np.exp(-decay * t) * np.cos(2 * np.pi * t) - amplitude - sag * (1 - np.cos(2 * np.pi * t))
    points = take.attached()[:, None] + y[None, :, None] * np.array([0.0, 0.0, 1.0])
    points = points + 1e-5 * np.random.default_rng(seed).standard_normal(points.shape)
    return dataclasses.replace(take, points=points.astype(np.float32), visible=np.ones(points.shape[:2], bool))


@pytest.fixture
def engine(monkeypatch):
    """In place of the engine: the same motion from the laws' numbers."""

    def simulate(take, values, places, spacing, frames):
        decay = 1e-3 * values.get("newtonian", {}).get("eta", 0.0)
        sag = 1e-3 * values.get("gravity", {}).get("z", 0.0)
        made = swinging(decay, sag, 0.01, 0)
        return (made.points - made.attached()[:, None])[:, :frames].astype(float)

    monkeypatch.setattr(let_go, "simulate", simulate)


LAWS = [
    Law("newtonian", lambda x: ({"newtonian": {"eta": x[0]}}, {}), ((100.0, 2000.0),), (1.0,), (1e4,)),
    Law("gravity", lambda x: ({"gravity": {"x": 0.0, "y": 0.0, "z": x[0]}}, {}), ((0.5, 4.0),), (-15.0,), (15.0,)),
]
BASE = {"corotated": {"E": 1e4, "nu": 0.45}}


def found(decay: float, sag: float):
    takes = (swinging(decay, sag, 0.01, seed) for seed in (1, 2))
    return name(LAWS, BASE, *takes, 0.01, 3.0, lambda *_: None)


@pytest.mark.parametrize(("decay", "sag", "law"), [(0.8, 0.0, "newtonian"), (0.0, 2e-3, "gravity")])
def test_the_law_that_was_left_out_is_named_with_its_number(engine, decay, sag, law):
    told = found(decay, sag)
    assert told.verdict.verdict == "named"
    assert told.verdict.names == (law,)
    value = told.physics["terms"][law]["eta" if law == "newtonian" else "z"]["value"]
    assert value == pytest.approx(1e3 * (decay or sag), rel=0.02)
    assert told.verdict.held_out["after"] < 0.05 * told.verdict.held_out["before"]
    (swing,) = told.panels
    assert np.ptp(swing.recorded[1]) == pytest.approx(np.ptp(swing.named[1]), rel=0.02)
    shown = {"case": "r", "title": "R", "concealed": "", "verdict": "named", "words": "", "answers": [], "direct": True}
    assert b"<img" in page([{**shown, "panels": [dataclasses.asdict(swing)]}])


def test_where_no_law_helps_none_is_named(engine, monkeypatch):
    useless = [dataclasses.replace(law, make=lambda x: ({}, {})) for law in LAWS[:1]]
    monkeypatch.setattr(let_go, "_physics", lambda *_: {})
    takes = (swinging(0.5, 0.0, 0.01, seed) for seed in (1, 2))
    told = name(useless, BASE, *takes, 0.01, 3.0, lambda *_: None)
    assert (told.verdict.verdict, told.verdict.names) == ("nothing detectable", ())


def fading(seed: int):
    """A take whose swings decay twice as fast in its first second as afterwards."""
    take = swinging(0.0, 0.0, 0.01, seed)
    t = np.arange(take.frames) / FPS
    lost = np.where(t < 1, 1.2 * t, 1.2 + 0.6 * (t - 1))
    y = 0.01 * np.exp(-lost) * np.cos(2 * np.pi * t) - 0.01
    points = take.attached()[:, None] + y[None, :, None] * np.array([0.0, 0.0, 1.0])
    return dataclasses.replace(take, points=points.astype(np.float32))


def test_all_swings_may_count_alike(engine):
    first, second = fading(1), fading(2)
    largest = name(LAWS[:1], BASE, first, second, 0.01, 3.0, lambda *_: None)
    every = name(LAWS[:1], BASE, first, second, 0.01, 3.0, lambda *_: None, swings=1.0)
    decays = [1e-3 * told.physics["terms"]["newtonian"]["eta"]["value"] for told in (largest, every)]
    # Over the three seconds it loses .8 per second on average, 1.2 in the first.
    assert abs(decays[1] - 0.8) < 0.6 * abs(decays[0] - 0.8), decays
