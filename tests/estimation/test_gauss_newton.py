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


def test_what_lies_beyond_a_bound_does_not_keep_the_others_from_their_best():
    def sums(x: np.ndarray, worker: int = 0) -> np.ndarray:
        return np.array([x[0] + x[1] - 4.0, 0.1 * (x[0] - x[1])])

    found = gauss_newton(
        sums, np.array([1.0, 0.0]), prior=np.zeros(2), spread=np.full(2, 1e4), differences=np.full(2, 1e-4),
        bounds=(np.full(2, -9.0), np.array([1.0, 9.0])), share=1.0, iterations=20, workers=1,
    )  # fmt: skip
    # With x0 = 1, (x1 - 3)^2 + .01 (1 - x1)^2 is least at 3.01 / 1.01.
    assert found.x == pytest.approx([1.0, 3.01 / 1.01], rel=1e-3)


def test_where_every_long_step_fits_worse_a_short_one_is_found():
    def bent(x: np.ndarray, worker: int = 0) -> np.ndarray:
        """Straight only very near to where the search begins."""
        return np.array([1.0 - x[0] + 40.0 * x[0] ** 2])

    found = gauss_newton(
        bent, np.zeros(1), prior=np.zeros(1), spread=np.full(1, 1e4), differences=np.full(1, 1e-6),
        bounds=(np.full(1, -9.0), np.full(1, 9.0)), share=1.0, iterations=40, workers=1,
    )  # fmt: skip
    assert found.x[0] == pytest.approx(1 / 80, rel=0.1)


@pytest.mark.parametrize("workers", [4, 6])
def test_steps_tried_side_by_side_lead_where_they_lead_in_turn(workers):
    def course(workers: int) -> list[np.ndarray]:
        passed: list[np.ndarray] = []
        gauss_newton(
            decay, np.array([1.0, 0.3]), prior=np.zeros(2), spread=np.full(2, 1e4), differences=np.full(2, 1e-4),
            bounds=(np.zeros(2), np.full(2, 9.0)), share=1.0, iterations=60, workers=workers,
            said=lambda iteration, x, cost: passed.append(x),
        )  # fmt: skip
        return passed

    assert np.array_equal(course(workers), course(1))
