"""A field of parameters goes on where one place of it cannot."""

from types import SimpleNamespace

import numpy as np
import pytest

from surgisim.estimation import refine as room
from surgisim.estimation.refine import refine
from surgisim.mpm.simulator import Breakdown

SOFT = -1.0
"""Logarithm of what every particle's parameter ought to be."""


class Body:
    """Particles whose displacement is the logarithm of their parameter; the first breaks at `breaks`."""

    breaks = 0.95

    rest = np.stack(np.meshgrid(*[np.linspace(0, 1, 6)] * 3), -1).reshape(-1, 3)
    grid = SimpleNamespace(spacing=0.2)

    def __init__(self, named: bool) -> None:
        self.named = named

    def run(self, theta, drive):
        if theta[0, 0] < self.breaks:
            raise Breakdown("turned inside out", 0 if self.named else None)
        return SimpleNamespace(u=np.repeat(np.log(theta)[None], 2, 0))

    def gradient(self, theta, drive, run, u_bar):
        return SimpleNamespace(theta=u_bar.sum(0) / theta)


class Seen:
    weight = np.ones((len(Body.rest), 2, 1))

    def residual(self, u, frames):
        return (u[frames] - SOFT).swapaxes(0, 1)

    def pulled_back(self, slope, u, frames):
        bar = np.zeros_like(u)
        bar[frames] = slope.swapaxes(0, 1)
        return bar


def refined(named: bool, seen=None):
    body, start = Body(named), np.ones((len(Body.rest), 1))
    return refine(
        body, lambda theta: (None, body.run(theta, None)), start, [0], seen or Seen(),
        train=np.array([0]), judge=np.array([1]), image=None, image_weight=0.0,
        iterations=40, smoothness=0.0, limits=(np.array([1e-3]), np.array([1e3])),
    )  # fmt: skip


def test_tissue_stays_as_it_is_where_it_breaks_and_goes_on_elsewhere():
    found = refined(named=True)
    away = np.linalg.norm(Body.rest, axis=1) > 0.8
    assert found.kept
    assert found.theta[0, 0] >= 0.95
    assert np.log(found.theta[away, 0]).mean() == pytest.approx(SOFT, abs=0.1)


def test_a_break_in_no_known_place_shortens_the_step():
    found = refined(named=False)
    assert found.theta.min() >= 0.94
    assert found.history[-1]["judged"] <= found.history[0]["judged"]


def test_every_step_that_is_kept_fits_better():
    track = [row["track"] for row in refined(named=True).history]
    assert (np.diff(track) < 0).all()


def test_where_the_last_steps_mislead_it_goes_straight_down_again(monkeypatch):
    def nearly_level(past, slope, free):
        level = np.random.default_rng(0).normal(size=slope.shape)
        level -= (level * slope).sum() / (slope * slope).sum() * slope
        return 0.1 * level - 1e-12 * slope

    monkeypatch.setattr(Body, "breaks", 0.0)
    monkeypatch.setattr(room._Past, "_toward_bottom", nearly_level)
    history = refined(named=True).history
    assert len(history) > 8
    assert history[-1]["judged"] < 0.5 * history[0]["judged"]


class Apart(Seen):
    """Of which one half ought to be far firmer than anything may become."""

    ought = np.where(Body.rest[:, :1] < 0.5, 10.0, SOFT)

    def residual(self, u, frames):
        return (u[frames] - self.ought).swapaxes(0, 1)


def test_what_is_at_its_limit_does_not_keep_the_rest_from_going_on(monkeypatch):
    monkeypatch.setattr(Body, "breaks", 0.0)
    found, soft = refined(named=True, seen=Apart()).theta, Body.rest[:, 0] > 0.7
    assert found.max() == pytest.approx(room.FIRMEST)
    assert np.log(found[soft]).mean() == pytest.approx(SOFT, abs=0.1)
