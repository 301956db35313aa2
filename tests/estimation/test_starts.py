"""A ring-down read at another pace is that of tissue with another modulus, so one tells of all."""

from types import SimpleNamespace

import numpy as np
import pytest

from surgisim.estimation.search import search
from surgisim.estimation.starts import WITHIN, Freed, at_pace, choose_start, freed
from surgisim.verification import clip_length


def swung(modulus: float, time: np.ndarray) -> np.ndarray:
    """A damped swing whose pace goes with the root of its modulus, (T, 1, 1)."""
    t = np.maximum(time, 0.0) * np.sqrt(modulus)
    return (np.exp(-0.3 * t) * np.cos(2 * t))[:, None, None]


@pytest.mark.parametrize("later", [-0.5, 0.0, 0.5])
def test_a_swing_read_faster_or_slower_is_that_of_another_modulus(later):
    free = Freed(let_go=6.5, last=30)
    held = swung(1.0, np.arange(free.since + 1) - free.let_go)
    fine = free.since + np.arange(WITHIN * (free.last - free.since) + 1) / WITHIN
    read = at_pace(held, swung(1.0, fine - free.let_go), free, 0.5, later)
    wanted = swung(0.25, np.arange(31) - free.let_go - later)
    assert read.shape == wanted.shape
    assert abs(read - wanted).max() < 0.02


def test_the_longest_stretch_without_a_grip_is_read():
    active = np.zeros((1, 40), bool)
    active[0, 5:10] = active[0, 13:20] = True
    motion = SimpleNamespace(active=active, late=np.array([0.3]))
    assert freed(motion, 40) == Freed(19.3, 39)
    assert Freed(let_go=0.2, last=5).since == 0
    assert Freed(let_go=-1.0, last=5).since == 0
    assert freed(SimpleNamespace(active=np.ones((1, 8), bool), late=np.zeros(1)), 8) is None


def test_another_pace_keeps_what_a_swing_dies_off_by():
    wanted = search(["corotated", "newtonian"], {}, [])
    x = wanted.paced(wanted.start, 1.0)
    before, after = wanted.values(wanted.start), wanted.values(x)
    assert after["corotated"]["E"] == pytest.approx(before["corotated"]["E"] * np.e)
    assert after["newtonian"]["eta"] == pytest.approx(before["newtonian"]["eta"] * np.sqrt(np.e))
    assert after["corotated"]["nu"] == before["corotated"]["nu"]


def test_the_start_lies_in_the_planted_modulus_own_valley():
    trial, _ = clip_length.trial(2 * clip_length.PERIOD)
    history = []
    x = choose_start(trial, trial.wanted.start, history, lambda *_: None)
    found = trial.wanted.values(x)
    assert found["corotated"]["E"] == pytest.approx(clip_length.TRUE["corotated"]["E"], rel=0.25)
    assert all(h["round"] == "start" for h in history)
