"""The descent over a few numbers: where it ends, and how often it takes a derivative."""

import numpy as np
import pytest

from surgisim.estimation import gauss_newton as descent
from surgisim.estimation.gauss_newton import gauss_newton

TRUE, TIME = np.array([2.0, 3.0]), np.linspace(0.0, 1.0, 20)


def decay(x: np.ndarray, worker: int = 0) -> np.ndarray:
    """A decay, and a misfit that no number mends, beside which every step wins little."""
    return np.append(x[0] * np.exp(-x[1] * TIME) - TRUE[0] * np.exp(-TRUE[1] * TIME), 6.0)


@pytest.fixture
def course(monkeypatch) -> tuple[list[str], np.ndarray]:
    """What was done in turn, a derivative or a step, and where it ended."""
    done: list[str] = []
    taken = descent.derivative
    monkeypatch.setattr(descent, "derivative", lambda *given: done.append("derivative") or taken(*given))
    found = gauss_newton(
        decay, np.array([1.0, 0.3]), prior=np.zeros(2), spread=np.full(2, 1e4), differences=np.full(2, 1e-4),
        bounds=(np.zeros(2), np.full(2, 9.0)), share=1.0, iterations=60, workers=1,
        said=lambda iteration, x, cost: done.append("step"),
    )  # fmt: skip
    return done[2:], found.x


def test_it_ends_at_the_least_misfit(course):
    assert course[1] == pytest.approx(TRUE, rel=0.02)


def test_a_derivative_just_taken_is_followed_more_than_a_step(course):
    done = " ".join(course[0])
    assert done.count("derivative") > 1
    assert "derivative step derivative step" not in done
