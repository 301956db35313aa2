"""From a few parameters through the run to a loss, and to pixels: derivatives against whole runs."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from tiny import FRAMES, TERMS, body, driven, on, under

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.scene import Scene
from surgisim.estimation.picture import picture_loss
from surgisim.gaussians.rasterise import render, to_bytes
from surgisim.mpm.chain import by_parameters
from surgisim.problem import Problem

CHAINED = [
    n
    for n in ("corotated", "tether", "added_mass", "sliding_base", "respiration", "tool_slip", "active_contraction")
    if n in TERMS
]


def off_by(found, loss, at, scale):
    """Relative error of a derivative against central differences, at the first step that leaves 1e-5 or less.

    Large steps bend, small ones drown in rounding, and one may cross a kink.
    """
    errors = []
    for h in (1e-6 * scale, 1e-5 * scale, 1e-7 * scale, 1e-4 * scale):
        wanted = (loss(at + h) - loss(at - h)) / (2 * h)
        errors.append(abs(found - wanted) / abs(wanted) if found or wanted else 0.0)
        if errors[-1] <= 1e-5:
            break
    return min(errors)


def weighed(made, values, places, c):
    """Loss of a run with these numbers, its drive made anew."""
    return (c * made.simulator.run(made.theta(values, places), driven(made, values)).u).sum()


@pytest.mark.parametrize("name", CHAINED)
def test_few_parameters_inherit_the_derivative_of_a_run(name):
    made, values = body(under(name)), on(under(name))
    drive, theta, places = driven(made, values), made.theta(values), made.places
    run = made.simulator.run(theta, drive)
    c = np.random.default_rng(3).standard_normal(run.u.shape)
    gradient = made.simulator.gradient(theta, drive, run, c, springs=True)
    found = by_parameters(made, values, None, gradient, partial(driven, made))[name]

    def with_param(param, x):
        return weighed(made, {**values, name: {**values[name], param: x}}, places, c)

    def with_place(x, **how):
        return weighed(made, values, {**places, name: replace(places[name], **{k: f(x) for k, f in how.items()})}, c)

    for param, about in TERMS[name].params.items():
        size = max(abs(values[name][param]), 1e-2 * (about.high - about.low))
        assert off_by(found[param], partial(with_param, param), values[name][param], size) <= 1e-5, param
    if name in places:
        center, extent = np.array(places[name].center), places[name].extent
        for a in range(3):
            along = lambda x, a=a: tuple(center + x * np.eye(3)[a])  # noqa: E731
            assert off_by(found["center"][a], partial(with_place, center=along), 0.0, extent) <= 1e-5, a
        assert off_by(found["extent"], partial(with_place, extent=float), extent, extent) <= 1e-5


def test_springs_that_follow_the_modulus_need_a_gradient_by_springs():
    made, values = body(under("newtonian")), on(under("newtonian"))
    drive, theta = driven(made, values), made.theta(values)
    run = made.simulator.run(theta, drive, last=1)
    gradient = made.simulator.gradient(theta, drive, run, run.u)
    with pytest.raises(Problem, match="anchors' stiffness changes with the values"):
        by_parameters(made, values, None, gradient, partial(driven, made))


def seen(made):
    """A camera 6 cm before the block, splats over its face, and the loss against frames of a stiffer block."""
    rng = np.random.default_rng(4)
    mean = np.column_stack([rng.uniform(-0.008, 0.008, (40, 2)), rng.uniform(0.06, 0.063, 40)])
    turn = rng.standard_normal((40, 4))
    scene = Scene(
        mean.astype(np.float32), rng.uniform(0, 3, 40).astype(np.float32),
        np.log(rng.uniform(5e-4, 2e-3, (40, 3))).astype(np.float32),
        (turn / np.linalg.norm(turn, axis=1, keepdims=True)).astype(np.float32), rng.random((40, 3)).astype(np.float32),
    )  # fmt: skip
    camera = Camera(
        width=24, height=20, fx=70.0, fy=70.0, cx=11.5, cy=9.5, fps=25.0, frames=FRAMES, scale="known",
        focal_from="given", source="block", source_size=[24, 20], crop=[0, 0, 24, 20],
    )  # fmt: skip
    other = on(under("newtonian")) | {"corotated": {"E": 9000.0, "nu": 0.3}}
    run = made.simulator.run(made.theta(other), driven(made, other))
    drawn = [np.exp(scene.scale), 1 / (1 + np.exp(-scene.opacity)), scene.color]
    carry = made.simulator.carry(scene.mean)
    rgb = np.stack([to_bytes(render(scene.mean + carry @ u, scene.rotation, *drawn, camera).rgb) for u in run.u])
    mask = np.ones(rgb.shape[:3], bool)
    frames = np.array([2, 4, 6])
    return lambda engine: picture_loss(scene, camera, rgb, mask, made.simulator, frames, engine=engine)


def pixels(made, engine, values):
    """Loss and its derivatives by the base laws' parameters, by way of pixels."""
    theta, drive = made.theta(values), driven(made, values)
    run = made.simulator.run(theta, drive)
    loss, u_bar = seen(made)(engine)(run.u)
    gradient = made.simulator.gradient(theta, drive, run, u_bar, springs=True)
    return loss, by_parameters(made, values, None, gradient, partial(driven, made)), gradient


def test_the_whole_chain_to_pixels_is_the_slope_of_the_picture_loss():
    made, values = body(under("newtonian")), on(under("newtonian"))
    loss = seen(made)("twin")
    _, found, gradient = pixels(made, "twin", values)
    for law, param in (("corotated", "E"), ("corotated", "nu"), ("newtonian", "eta")):

        def of(x, law=law, param=param):
            changed = {**values, law: {**values[law], param: x}}
            return loss(made.simulator.run(made.theta(changed), driven(made, changed)).u)[0]

        at = values[law][param]
        assert off_by(found[law][param], of, at, at) <= 1e-5, param
    drive, way = driven(made, values), 1e-3 * np.random.default_rng(5).standard_normal(gradient.path.shape)

    def along(x):
        return loss(made.simulator.run(made.theta(values), replace(drive, path=drive.path + x * way)).u)[0]

    assert off_by((gradient.path * way).sum(), along, 0.0, 1.0) <= 1e-5


def test_the_fast_rasteriser_gives_the_same_gradient_of_the_picture_to_a_hundredth():
    made, values = body(under("newtonian")), on(under("newtonian"))
    (loss, found, gradient), (twin_loss, exact, twin_gradient) = (pixels(made, e, values) for e in ("numba", "twin"))
    assert loss == pytest.approx(twin_loss, rel=1e-3)
    assert np.linalg.norm(gradient.path - twin_gradient.path) < 1e-2 * np.linalg.norm(twin_gradient.path)
    assert found["corotated"]["E"] == pytest.approx(exact["corotated"]["E"], rel=1e-2)
