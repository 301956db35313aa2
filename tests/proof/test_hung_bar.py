"""A bar hung out by one end: which part of it is soft, from where its points came to rest."""

import dataclasses

import numpy as np
import pytest
from proof import made_up

from surgisim.mpm.simulator import Breakdown
from surgisim.proof.known.silicone_halves import ask
from surgisim.proof.recorded.hanging_beam import BAR
from surgisim.proof.rigs import hung_bar, let_go
from surgisim.recordings.recording import no_grips

T = 6


def hung(E: float, factor: float, seam: float):
    """Places along a bar (N,), and how far they sag, (N, T, 3) [m], by the bending of what lies towards the clamp."""
    x = np.linspace(BAR / 2, -BAR / 2, 401)
    stiffness = E * (1 + (factor - 1) * 0.5 * (1 + np.tanh((x - seam) / 0.004)))
    turn = np.cumsum((x + BAR / 2) ** 2 / stiffness)
    sag = 4e6 * np.cumsum(turn) / len(x) ** 2
    return x, np.repeat(np.stack([0 * x, -sag, 0 * x], 1)[:, None], T, 1)


@pytest.fixture
def engine(monkeypatch):
    """In place of the engine: the same bar from the laws' numbers; laws other than a part do nothing."""

    def simulate(take, values, places, spacing, frames):
        place = places.get("stiff_inclusion")
        factor = values.get("stiff_inclusion", {}).get("s", 1.0)
        x, moved = hung(values["corotated"]["E"], factor, place.center[0] if place else 9.0)
        return np.stack([moved[np.abs(x - at).argmin(), :frames] for at in take.attached()[:, 0]])

    for room in (let_go, hung_bar):
        monkeypatch.setattr(room, "simulate", simulate)


def bar(factor: float):
    x, moved = hung(6e4, factor, 0.0)
    x, moved = x[20:-20:20], moved[20:-20:20]
    place = np.stack([x, 0 * x, 0 * x], 1)
    recording = made_up.recording(seed=1)
    return dataclasses.replace(
        recording, place=place, points=(place[:, None] + moved).astype(np.float32),
        visible=np.ones((len(x), T), bool), sigma=np.full(len(x), 1e-3), split=None,
        motion=no_grips(T),
    )  # fmt: skip


@pytest.mark.parametrize("factor", [0.4, 2.5])
def test_the_soft_part_is_found_at_either_end(engine, tmp_path, factor):
    told = hung_bar.concealed_halves(bar(factor), lambda *_: None)
    assert told.verdict.names == ("stiff_inclusion",)
    found = told.verdict.effects[0]
    assert found.parameters["s"]["value"] == pytest.approx(factor, rel=0.15)
    assert found.center[0] == pytest.approx(0.0, abs=0.05 * BAR)
    (shape,) = told.panels
    recorded, base, named = (np.array(line[1]) for line in (shape.recorded, shape.base, shape.named))
    assert np.abs(named - recorded).max() < 0.3 * np.abs(base - recorded).max()
    assert told.verdict.held_out["after"] < 0.3 * told.verdict.held_out["before"]
    # The makers' bar is the softer at its clamp.
    assert [a.met for a in ask(tmp_path, told)] == [True, factor < 1]


def test_only_where_it_came_to_rest_counts():
    some = hung_bar.some(bar(0.4), slice(1, None, 2))
    assert some.visible.sum(1).tolist() == [1] * len(some.place)
    assert np.isnan(some.points[:, :-1]).all()
    assert np.isfinite(some.points[:, -1]).all()


def test_a_body_that_is_nowhere_is_no_good_fit():
    moved = np.zeros(bar(0.4).points.shape)
    moved[3, -1] = np.nan
    with pytest.raises(Breakdown, match="nowhere"):
        let_go.misfit(bar(0.4), moved)
