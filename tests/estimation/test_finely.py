"""A fit ends on a finer grid where that can be simulated, and stays where it was where it cannot."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from surgisim.estimation import fit
from surgisim.estimation.gauss_newton import Solution


@dataclass(frozen=True)
class Breaking:
    """A trial that breaks down on any grid but its own."""

    laying: SimpleNamespace
    wanted: SimpleNamespace

    def residual(self, x, worker):
        return None


def test_a_finer_grid_that_breaks_down_leaves_the_fit_as_it_was(monkeypatch):
    laying = SimpleNamespace(finer=lambda times: f"{times} times finer")
    wanted = SimpleNamespace(bounds=(np.full(2, -9.0), np.full(2, 9.0)), spread=np.ones(2))
    trial = Breaking(laying, wanted)
    monkeypatch.setattr(fit, "on_no_grid", lambda trial, x: (np.zeros(2), np.zeros((2, 2))))
    solution, history = Solution(np.ones(2), np.zeros(3), np.zeros((3, 2))), []
    kept, same = fit._finely(trial, solution, history, lambda *_: None)
    assert kept is trial
    assert same is solution
    assert history[0]["round"] == "finer grid"
    assert "finer one" in history[0]["broke"]
