"""A fit ends on a finer grid where that can be simulated, and stays where it was where it cannot."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from surgisim.estimation import finer
from surgisim.estimation.gauss_newton import Solution


@dataclass(frozen=True)
class Breaking:
    """A trial that breaks down on any grid but its own."""

    laying: SimpleNamespace
    wanted: SimpleNamespace
    eased: float | None = None

    def residual(self, x, worker):
        return None


def test_a_finer_grid_that_breaks_down_leaves_the_fit_as_it_was(monkeypatch):
    laying = SimpleNamespace(finer=lambda times: SimpleNamespace(shared=lambda threads: None))
    wanted = SimpleNamespace(bounds=(np.full(2, -9.0), np.full(2, 9.0)), spread=np.ones(2))
    trial = Breaking(laying, wanted)
    monkeypatch.setattr(finer, "on_no_grid", lambda trial, x: (np.zeros(2), np.zeros((2, 2))))
    solution, history = Solution(np.ones(2), np.zeros(3), np.zeros((3, 2))), []
    kept, same = finer.finely(trial, solution, history, lambda *_: None)
    assert kept is trial
    assert same is solution
    assert history[0]["round"] == "finer grid"
    assert "finer one" in history[0]["broke"]


@dataclass(frozen=True)
class Laid:
    """A settled trial of a body whose uniform columns are `theta`'s."""

    bodies: list

    def theta(self, values):
        return np.tile([values["corotated"]["E"], 0.0], (len(self.bodies[0].body.rest), 1))


def laid(places):
    return Laid([SimpleNamespace(body=SimpleNamespace(rest=np.array(places, float)))])


def test_a_field_is_as_many_times_stiffer_at_the_same_place_on_another_grid():
    coarse, fine = laid([[0, 0, 0], [1, 0, 0]]), laid([[0.1, 0, 0], [0.4, 0, 0], [0.9, 0, 0]])
    field = np.array([[2000.0, 0.0], [500.0, 0.0]])
    at = {E: {"corotated": {"E": E}} for E in (1000.0, 900.0)}
    there = finer.brought(field, coarse, at[1000.0], fine, at[900.0])
    assert there.tolist() == [[1800.0, 0.0], [1800.0, 0.0], [450.0, 0.0]]


@dataclass(frozen=True)
class Bowl:
    """A trial whose finer grid wants another x, which a derivative as wrong as this one finds in several steps."""

    laying: SimpleNamespace
    wanted: SimpleNamespace
    eased: float | None
    runs: list

    def residual(self, x, worker):
        self.runs.append(x.copy())
        return 3.0 * (x - 0.5)


def test_what_nothing_tells_the_pace_of_takes_one_step_on_a_finer_grid(monkeypatch):
    monkeypatch.setattr(finer, "on_no_grid", lambda trial, x: (np.zeros(2), np.zeros((2, 2))))
    laying = SimpleNamespace(finer=lambda times: SimpleNamespace(shared=lambda threads: None))
    bounds = np.full(2, -9.0), np.full(2, 9.0)
    wanted = SimpleNamespace(bounds=bounds, spread=np.full(2, 9.0), start=np.zeros(2), free=[], open=[])
    wanted.values = lambda x: {}
    trial = Bowl(laying, wanted, 0.0, [])
    _, there = finer.finely(trial, Solution(np.ones(2), np.full(2, 1.5), 4 * np.eye(2)), [], lambda *_: None)
    assert len(trial.runs) == 2
    assert np.all(there.x < 1.0)
