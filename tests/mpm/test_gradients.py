"""The adjoint of whole runs against central differences, for every law."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from tiny import PER_FRAME, TERMS, beside, body, off, on, start, under

from surgisim.problem import Problem

every_law = pytest.mark.parametrize("name", TERMS)
every_state = pytest.mark.parametrize("state", ["rest", "equal stretch", "turned"])
# A second each, but some two hundred and fifty of them.
one_step_or_many = pytest.mark.parametrize("steps", [1, pytest.param(1000, marks=pytest.mark.slow)])


def own(name, names=None):
    """Which columns of theta are this law's."""
    widths = {n: len(TERMS[n].row(on([n])[n])) for n in names or under(name)}
    first = sum(list(widths.values())[: list(widths).index(name)])
    return range(first, first + widths[name])


def directions(name, theta, begin, drive, gradient):
    """Label -> (derivative by the adjoint, what to vary): the law's columns, the drive, and the first state."""
    rng, result = np.random.default_rng(2), {}
    for k, column in zip(own(name), TERMS[name].row(on([name])[name]), strict=True):
        way, scale = np.zeros_like(theta), np.abs(theta[:, k])
        way[:, k] = (scale if scale.any() else 1.0) * rng.uniform(0.2, 1, len(theta))
        result[column] = (gradient.theta * way).sum(), (way, None, None, None)
    path, hold = 1e-3 * rng.standard_normal(drive.path.shape), -rng.random(drive.hold.shape)
    spring = drive.stiffness.max() * rng.standard_normal(drive.stiffness.shape) * 0.1
    u, v = 1e-3 * rng.standard_normal(begin[0].shape), 1e-1 * rng.standard_normal(begin[1].shape)
    slopes = [
        (gradient.path * path).sum() + (gradient.hold * hold).sum() + (gradient.stiffness * spring).sum(),
        (gradient.u * u).sum(),
        (gradient.v * v).sum(),
    ]
    # All three at once, each as large as the middle one in what it does to the loss.
    size = np.median(np.abs(slopes))
    a, b, c = size / np.array(slopes)
    result["drive and first state"] = 3 * size, (None, (a * path, a * hold, a * spring), b * u, c * v)
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


@cache
def case(name, state, steps, precision="double", memory_mb=512.0, sharp=False):
    """A run, a loss that weighs all it leaves at random, and its gradient: run, theta, start, first run, weights.

    In single precision other laws are there too, switched off: their kernel serves several.
    """
    others = under(name) if precision == "double" else beside(name)
    made, values = body(others, precision, sharp), {n: off(n) for n in others} | on(under(name))
    theta, at = made.theta(values), start(made, values, state, steps)

    def run(theta, drive, begin):
        return made.simulator.run(theta, drive, begin=begin, first=at.first, last=at.last)

    out = run(theta, at.drive, at.begin)
    c = np.random.default_rng(1).standard_normal(out.u.shape)
    gradient = made.simulator.gradient(theta, at.drive, out, c, first=at.first, springs=True, memory_mb=memory_mb)
    return run, theta, at, out, c, gradient


@every_law
@every_state
@one_step_or_many
def test_the_adjoint_of_a_run_is_the_slope_of_its_loss(name, state, steps):
    assert_slope(name, steps, *case(name, state, steps))


def test_the_adjoint_holds_where_tissue_may_bend_at_the_grip():
    assert_slope("added_mass", 1000, *case("added_mass", "equal stretch", 1000, sharp=True))


def assert_slope(name, steps, run, theta, at, out, c, gradient):
    rounding = 2e-12 * np.linalg.norm(c * out.u)
    for label, (slope, way) in directions(name, theta, at.begin, at.drive, gradient).items():
        # Large steps bend, small ones drown in rounding, and a kink (slip, yield, a maximum) may lie within one.
        errors = {}
        for h in (1e-4, 1e-5, 1e-6) if steps == 1 else (1e-6, 1e-5, 1e-7, 1e-4, 1e-3, 1e-8, 1e-9):
            up, down = (run(*moved(theta, at.drive, at.begin, way, s * h)).u for s in (1, -1))
            wanted = (c * (up - down)).sum() / (2 * h)
            errors[h] = abs(slope - wanted) - 1e-5 * abs(wanted) - rounding
            if errors[h] <= 0:
                break
        assert min(errors.values()) <= 0, (label, slope, errors)


@every_law
@every_state
@one_step_or_many
def test_single_precision_gives_the_same_gradient_to_a_hundredth(name, state, steps):
    _, theta, _, out, c, exact = case(name, state, steps)
    *_, single = case(name, state, steps, "single")
    for block in ("theta", "path", "hold", "stiffness", "u", "v"):
        wanted, found = getattr(exact, block), getattr(single, block)
        if block == "theta":
            # Per share of its value. After one step from rest or a turn, a law may have done nothing but round.
            mine, size = own(name), np.where(theta.any(0), np.abs(theta).max(0), 1.0)
            wanted, found = wanted[:, mine] * size[mine], found[:, own(name, beside(name))] * size[mine]
            if steps == 1:
                wanted, found = (np.append(a, 1e-3 * np.linalg.norm(c * out.u)) for a in (wanted, found))
        assert np.linalg.norm(found - wanted) <= 1e-2 * np.linalg.norm(wanted), block


def test_a_frame_walked_back_in_several_stretches_gives_the_same_gradient():
    *_, whole = case("sliding_base", "rest", 1000)
    *_, pieces = case("sliding_base", "rest", 1000, memory_mb=0.3)
    for block in ("theta", "path", "hold", "stiffness", "u", "v"):
        assert np.array_equal(getattr(pieces, block), getattr(whole, block)), block


def test_too_little_memory_for_a_frame_is_refused_with_what_is_needed():
    wanted = rf"0\.01 MB hold \d+ states, too few for the {PER_FRAME} steps of a frame. Allow at least 0\.\d MB"
    with pytest.raises(Problem, match=wanted):
        case("sliding_base", "rest", 1000, memory_mb=0.01)
