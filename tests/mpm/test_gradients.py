"""The adjoint of whole runs against central differences, for every law."""

from dataclasses import replace

import numpy as np
import pytest
from tiny import TERMS, body, driven, off, on, start, under

from surgisim.problem import Problem

EPS = np.finfo(float).eps

every_law = pytest.mark.parametrize("name", TERMS)
every_state = pytest.mark.parametrize("state", ["rest", "equal stretch", "turned"])


def loss_weights(run):
    return np.random.default_rng(1).standard_normal(run.u.shape)


def directions(made, name, theta, begin, drive, gradient):
    """Label -> (derivative by the adjoint, what to vary): the law's columns, the drive, and the first state."""
    rng, rows = np.random.default_rng(2), list(TERMS[name].row(on([name])[name]))
    first = theta.shape[1] - len(rows) if name not in ("corotated", "newtonian") else 2 * (name == "newtonian")
    result = {}
    for k, column in enumerate(rows):
        way = np.zeros_like(theta)
        scale = np.abs(theta[:, first + k])
        way[:, first + k] = (scale if scale.any() else 1.0) * rng.uniform(0.2, 1, len(theta))
        result[f"{name}.{column}"] = (gradient.theta * way).sum(), (way, None, None, None)
    path, hold = 1e-3 * rng.standard_normal(drive.path.shape), -rng.random(drive.hold.shape)
    spring = drive.stiffness.max() * rng.standard_normal(drive.stiffness.shape) * 0.1
    by = (gradient.path * path).sum() + (gradient.hold * hold).sum() + (gradient.stiffness * spring).sum()
    result["drive"] = by, (None, (path, hold, spring), None, None)
    u, v = 1e-3 * rng.standard_normal(begin[0].shape), 1e-1 * rng.standard_normal(begin[1].shape)
    result["first displacement"] = (gradient.u * u).sum(), (None, None, u, None)
    result["first velocity"] = (gradient.v * v).sum(), (None, None, None, v)
    return result


def moved(theta, drive, begin, way, h):
    """A run's inputs, a step h along a direction."""
    columns, anchors, u, v = way
    if columns is not None:
        theta = theta + h * columns
    if anchors is not None:
        path, hold, spring = anchors
        hold = np.where(drive.hold > 0, drive.hold + h * hold, 0)
        drive = replace(drive, path=drive.path + h * path, hold=hold, stiffness=drive.stiffness + h * spring)
    return theta, drive, (begin[0] if u is None else begin[0] + h * u, begin[1] if v is None else begin[1] + h * v)


@every_law
@every_state
@pytest.mark.parametrize("steps", [1, 1000])
def test_the_adjoint_of_a_run_is_the_slope_of_its_loss(name, state, steps):
    made, values = body(under(name)), on(under(name))
    theta, at = made.theta(values), start(made, values, state, steps)

    def run(theta, drive, begin):
        return made.simulator.run(theta, drive, begin=begin, first=at.first, last=at.last)

    out = run(theta, at.drive, at.begin)
    c = loss_weights(out)
    gradient = made.simulator.gradient(theta, at.drive, out, c, first=at.first, springs=True)
    h = 1e-4 if steps == 1 else 1e-6
    noise = 50 * EPS * np.abs(c * out.u).sum() / h
    for label, (slope, way) in directions(made, name, theta, at.begin, at.drive, gradient).items():
        up, down = (run(*moved(theta, at.drive, at.begin, way, s * h)).u for s in (1, -1))
        wanted = (c * (up - down)).sum() / (2 * h)
        if DEBUG: print(f"{name:18s} {state:14s} {steps:5d} {label:30s} {slope:12.4e} {abs(slope - wanted) / (abs(wanted) + 1e-300):9.1e} noise {noise / (abs(wanted) + 1e-300):8.1e}")
        else: assert slope == pytest.approx(wanted, rel=1e-5, abs=noise), label
DEBUG = False
