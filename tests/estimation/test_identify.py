"""What a fit says it can tell."""

import numpy as np
import pytest

from surgisim.estimation.gauss_newton import Solution, derivative
from surgisim.estimation.identify import identifiability, in_words, regional
from surgisim.estimation.search import search
from surgisim.estimation.support import Support
from surgisim.mpm.simulator import Breakdown


def told(model=None, phase="release", wider=1.0):
    """The table of a fit whose residuals tell every parameter to a hundredth of its search space."""
    wanted = search(["corotated", "newtonian"], {}, [])
    slope = np.vstack([100 * np.eye(3)] * 50)
    solution = Solution(wanted.start, np.full(len(slope), 0.5), slope)
    one = np.zeros(len(slope), int)
    return identifiability(
        solution, wanted, phase_of=one, phase_names=(phase,), density=1050.0, length=0.015, independent=0.02,
        region=np.repeat(np.arange(10), 15), model=model, wider=wider,
    )  # fmt: skip


def width(q):
    return np.log(q["high"] / q["low"]) / 2 / 1.645


def test_the_simulations_own_error_belongs_to_every_interval():
    error = {"grid": np.diag([0.03, 0.0, 0.04]) ** 2}
    alone, both = told(), told(error)
    for name, own in (("corotated.E", 0.03), ("newtonian.eta", 0.04), ("newtonian.eta / corotated.E", 0.05)):
        assert width(both[name]) == pytest.approx(np.hypot(width(alone[name]), own), rel=1e-9)
    assert both["corotated.nu"] == alone["corotated.nu"]


def test_what_the_simulation_itself_gets_wrong_by_much_is_not_told():
    assert told()["corotated.E"]["told"]
    assert not told({"grid": np.diag([0.5, 0.0, 0.0]) ** 2})["corotated.E"]["told"]


def test_wider_intervals_are_never_wider_than_the_prior():
    as_said, wider, widest = told(), told(wider=1.4), told(wider=1e6)
    wanted = search(["corotated", "newtonian"], {}, [])
    for name, prior in zip(wanted.names, wanted.spread, strict=True):
        if name != "corotated.nu":
            assert width(wider[name]) == pytest.approx(1.4 * width(as_said[name]))
            assert width(widest[name]) == pytest.approx(prior)
    wide = {"grid": np.diag([3.0, 0.0, 0.0]) ** 2}
    assert width(told(wide, wider=1.4)["corotated.E"]) == pytest.approx(width(told(wide)["corotated.E"]))


def test_what_an_interval_rests_on_is_named():
    table = told({"focal length": np.diag([0.05, 0.0, 0.0]) ** 2, "grid": np.diag([0.001, 0.0, 0.0]) ** 2})
    assert list(table["corotated.E"]["rests_on"]) == ["focal length"]
    assert table["corotated.nu"]["rests_on"] == {}
    words = in_words(table, Support(0.01, 0.0, False), 1.0, 20, 1e-3, 1e-4, None)
    assert "corotated.E" in next(part for part in words.split("How far ")[1:] if part.endswith("focal length."))


def test_where_regions_agree_intervals_are_those_of_the_noise_and_where_they_do_not_wider():
    rng = np.random.default_rng(0)
    J, spread, share = rng.normal(size=(1200, 3)), np.full(3, 10.0), 0.5
    region = np.repeat(np.arange(12), 100)
    noise = rng.normal(size=1200) / np.sqrt(share)
    plain = np.linalg.inv(share * J.T @ J + np.eye(3) / 100)
    agreeing = regional(J, noise, share, spread, region)
    assert np.sqrt(np.diag(agreeing) / np.diag(plain)).min() > 0.9
    assert np.sqrt(np.diag(agreeing) / np.diag(plain)).max() < 1.7
    apart = noise + 0.5 * J[:, 0] * np.where(region % 2, 1.0, -1.0)
    wide = np.sqrt(np.diag(regional(J, apart, share, spread, region)) / np.diag(plain))
    assert wide[0] > 2.5
    assert wide[1:].max() < 2


def test_no_viscosity_is_told_by_tissue_that_is_driven_all_the_time():
    free, driven = told(), told(phase="load")
    for name in ("corotated.E", "newtonian.eta", "newtonian.eta / corotated.E"):
        assert free[name]["told"]
        assert not driven[name]["told"]
    assert driven["corotated.nu"]["told"]


def test_a_derivative_where_only_small_steps_can_be_simulated():
    """A body that hardly bears its pull breaks down on either side of where it is, but not a small step beside."""

    def together(xs):
        return [None if abs(x[1]) > 0.01 else np.array([3.0 * x[0], 2.0 * x[1], x[0] * x[1]]) for x in xs]

    x, ends = np.array([1.0, 0.0]), (np.full(2, -9.0), np.full(2, 9.0))
    J = derivative(together, x, together([x])[0], np.array([0.1, 0.12]), ends)
    assert pytest.approx(np.array([[3.0, 0.0], [0.0, 2.0], [0.0, 1.0]])) == J
    with pytest.raises(Breakdown, match="a small step beside"):
        derivative(together, x, together([x])[0], np.array([0.1, 0.5]), ends)
