"""Frames that are not looked at: whether the surface goes straight on through them."""

import numpy as np
import pytest
import torch

from surgisim.gaussians.straight import UNTOLD, off_midway, straightness

FRAME = np.array([0, 1, 2, 4, 5, 6, 8, 9])
UNSEEN = np.array([3, 7])


def told(way, sure=1.0):
    """s in both frames that are not looked at, of pixels that go so far, `way(frame)` [px]."""
    went = torch.zeros(len(FRAME), 40, 50, 2)
    for k, t in enumerate(FRAME):
        went[k, ..., 1] = way(t)
    each = straightness(FRAME, UNSEEN, went, torch.full((len(FRAME), 40, 50), sure))
    assert each.shape == (2, 40, 50)
    return each[:, 0, 0].tolist()


def test_what_stands_still_or_goes_on_as_it_went_goes_straight():
    assert told(lambda t: 0.0) == [1, 1]
    assert np.allclose(told(lambda t: 2.0 * t), 1, atol=1e-6)


def test_what_is_let_go_in_between_does_not():
    let_go = told(lambda t: 3.0 * min(t, 3))
    assert let_go[0] < 0.05
    assert let_go[1] == 1


def test_noise_of_tracks_bends_nothing():
    assert min(told(lambda t: 0.002 * (t % 2))) > 0.8


def test_what_is_not_followed_goes_as_all_that_is():
    went = torch.zeros(len(FRAME), 40, 50, 2)
    went[..., 1] = torch.tensor([3.0 * min(t, 3) for t in FRAME])[:, None, None]
    went[:, :, :25] = 0.0
    sure = torch.ones(len(FRAME), 40, 50)
    sure[:, :10] = 0.0
    let_go, _ = straightness(FRAME, UNSEEN, went, sure)
    assert (let_go[10:, :25] == 1).all()
    assert (let_go[10:, 25:] < 0.01).all()
    assert (let_go[:10] < 0.01).all()


def test_frames_that_nothing_tells_of_are_hardly_taken_for_straight():
    assert np.allclose(told(lambda t: 3.0 * min(t, 3), sure=0.0), UNTOLD)
    went = torch.rand(3, 4, 5, 2)
    assert (straightness(np.array([0, 2, 3]), np.array([1]), went, torch.ones(3, 4, 5)) == UNTOLD).all()


class Carried:
    """A field whose changes go straight, but for one of them at the second of three moments."""

    def __init__(self, bent):
        self.bent = bent

    def at(self, mean, times):
        return tuple(map(torch.stack, zip(*[self(mean, time) for time in times], strict=True)))

    def __call__(self, mean, time):
        sizes = (3,), (), (4,), (3,)
        off = [0.3 if k == self.bent and time == 3.0 else 0.0 for k in range(4)]
        return tuple(torch.full((len(mean), *size), time + o) for size, o in zip(sizes, off, strict=True))


@pytest.mark.parametrize(("bent", "off"), [(None, 0), (0, 0.3 * 3**0.5 / 0.1), (1, 0.3), (2, 0.3), (3, 0.3)])
def test_place_opacity_turn_and_size_are_each_asked_to_go_straight(bent, off):
    mean, moments = torch.zeros(5, 3), (2.0, 3.0, 5.0)
    straight = torch.tensor([1, 1, 1, 0, 0.5])
    found = off_midway(Carried(bent), mean, moments, straight, unit=0.1)
    assert float(found) == pytest.approx(0.7 * off, abs=1e-5)
