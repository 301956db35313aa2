"""Known answers of the total-Lagrangian engine."""

import numpy as np
import pytest
from slab import pulled, slab

from surgisim.mpm.cut import Cut
from surgisim.mpm.grid import Grid
from surgisim.mpm.setup import prepare
from surgisim.mpm.simulator import Breakdown
from surgisim.mpm.stable import check_step
from surgisim.problem import Problem

SOFT = {"corotated": {"E": 1500.0, "nu": 0.42}, "newtonian": {"eta": 2.0}}
FPS = 25.0


def prepared(values=None, body=None, **more):
    values = values or SOFT
    body = body or slab()
    return prepare(body, tuple(values), density=1050.0, **more), body


def run(made, body, values, motion, refine=1, held=None):
    per_frame = made.per_frame(values, FPS) * refine
    path = made.drive(motion, values, fps=FPS, per_frame=per_frame, held=held)
    return made.simulator.run(made.theta(values), path), path


def free(body, frames=8):
    motion = pulled(frames=frames)
    return type(motion)(
        np.zeros((0, 3)), np.zeros(0), np.zeros((0, frames, 3)), np.zeros((0, frames), bool), np.zeros(0), "none"
    )


def test_interpolation_reproduces_linear_fields_exactly():
    points = np.random.default_rng(0).uniform(0, 1, (50, 3))
    grid = Grid.around(points, 0.2)
    A = np.arange(9.0).reshape(3, 3)
    field = grid.positions() @ A.T
    assert np.allclose(grid.interpolate(field, points), points @ A.T)
    assert np.allclose(grid.deformation_gradient(field, points), np.eye(3) + A)


def test_points_carried_along_do_not_shift_the_cells():
    points = np.random.default_rng(0).uniform(0, 1, (50, 3))
    alone, wider = Grid.around(points, 0.2), Grid.around(points, 0.2, np.array([[-0.33, 0.5, 2.0]]))
    shift = (alone.origin - wider.origin) / 0.2
    assert np.allclose(shift, np.round(shift))
    assert (wider.stencil(np.array([[-0.33, 0.5, 2.0]]))[1].sum() - 1) < 1e-9


def test_a_body_that_nothing_holds_falls_freely():
    made, body = prepared(gravity=(0.0, 9.81, 0.0))
    motion = free(body)
    out, path = run(made, body, SOFT, motion, held=np.zeros(len(body.rest), bool))
    time = (len(out.u) - 1) / FPS
    # Symplectic Euler overshoots by half a step: y = g t (t + dt) / 2.
    assert np.allclose(out.u[-1][:, 1], 9.81 * time * (time + path.step) / 2, rtol=1e-4)


def test_momentum_is_kept_when_nothing_pushes():
    made, body = prepared()
    mass = made.simulator.mass.numpy()[:, None]
    positions = made.simulator.grid.positions()[made.simulator.place]
    v = np.cross([0.0, 0.0, 8.0], positions - positions.mean(0)) + np.array([0.1, 0.0, 0.0])
    motion = free(body, 12)
    none = np.zeros(len(body.rest), bool)
    path = made.drive(motion, SOFT, fps=FPS, per_frame=made.per_frame(SOFT, FPS), held=none)
    out = made.simulator.run(made.theta(SOFT), path, begin=(np.zeros_like(v), v))
    before, after = (mass * v).sum(0), (mass * out.v[-1]).sum(0)
    assert np.allclose(after, before, atol=1e-5 * np.abs(before).max())


def test_without_viscosity_no_energy_is_lost_to_the_method():
    values = {"corotated": {"E": 1500.0, "nu": 0.3}}
    made, body = prepared(values)
    motion = pulled(frames=60, hold=6, by=(0.0, 0.0015, 0.0))
    out, _ = run(made, body, values, motion)
    kinetic = (made.simulator.mass.numpy() * (out.v**2).sum(-1)).sum(-1)
    late, early = kinetic[40:].mean(), kinetic[10:30].mean()
    assert 0.8 < late / early < 1.25


def test_viscosity_brings_the_body_to_rest():
    made, body = prepared()
    out, _ = run(made, body, SOFT, pulled(frames=40, hold=6))
    assert np.abs(out.u[-1]).max() < 0.05 * np.abs(out.u[6]).max()


def test_a_smaller_step_shifts_the_release_by_no_more_than_half_a_step():
    made, body = prepared()
    coarse, path = run(made, body, SOFT, pulled())
    fine, _ = run(made, body, SOFT, pulled(), refine=4)
    speed = np.abs(np.diff(fine.u, axis=0)).max() * FPS
    assert np.abs(coarse.u - fine.u).max() < speed * path.step


def test_the_gripped_ball_follows_the_grip():
    made, body = prepared()
    motion = pulled()
    out, _ = run(made, body, SOFT, motion)
    center = made.simulator.grid.interpolate(made.simulator.displaced(out.u[8]), motion.center_rest)
    wanted = motion.position[0, 8] - motion.center_rest[0]
    assert np.linalg.norm(center - wanted) < 0.1 * np.linalg.norm(wanted)


def test_two_runs_give_the_same_bytes():
    made, body = prepared()
    assert run(made, body, SOFT, pulled())[0].u.tobytes() == run(made, body, SOFT, pulled())[0].u.tobytes()


def test_two_threads_do_what_one_does():
    runs = []
    for threads in (1, 2):
        made, body = prepared(threads=threads)
        out, path = run(made, body, SOFT, pulled())
        weight = np.random.default_rng(0).standard_normal(out.u.shape)
        runs.append((out.u, made.simulator.gradient(made.theta(SOFT), path, out, weight).theta))
    (u, g), (u2, g2) = runs
    assert np.abs(u - u2).max() < 1e-5 * np.abs(u).max()
    assert np.abs(g - g2).max() < 1e-3 * np.abs(g).max()


def test_a_run_goes_on_from_where_it_stopped():
    made, _ = prepared()
    motion = pulled()
    path = made.drive(motion, SOFT, fps=FPS, per_frame=made.per_frame(SOFT, FPS))
    theta = made.theta(SOFT)
    whole = made.simulator.run(theta, path)
    first = made.simulator.run(theta, path, last=7)
    second = made.simulator.run(theta, path, begin=(first.u[-1], first.v[-1]), first=7)
    assert np.array_equal(second.u[-1], whole.u[-1])


def test_the_adjoint_is_the_slope_of_a_loss_on_all_frames():
    values = {"corotated": {"E": 1500.0, "nu": 0.4}, "newtonian": {"eta": 3.0}}
    body = slab(size=(0.036, 0.03, 0.018))
    made, _ = prepared(values, body)
    motion = pulled(frames=10, hold=6)
    path = made.drive(motion, values, fps=FPS, per_frame=made.per_frame(values, FPS, 0.8))
    theta, rng = made.theta(values), np.random.default_rng(0)
    out = made.simulator.run(theta, path)
    c = rng.standard_normal(out.u.shape)
    gradient = made.simulator.gradient(theta, path, out, c).theta
    for column in range(theta.shape[1]):
        along = rng.random(len(theta))[:, None] * np.eye(theta.shape[1])[column]
        h = 0.01 * theta[0, column]
        up, down = (made.simulator.run(theta + s * h * along, path).u.astype(float) for s in (1, -1))
        slope = (c * (up - down)).sum() / (2 * h)
        assert (gradient * along).sum() == pytest.approx(slope, rel=1e-2)


def test_inverted_tissue_stops_the_run_and_is_named():
    made, body = prepared()
    with pytest.raises(Breakdown, match=r"particle \d+ at rest position .* at step \d+"):
        run(made, body, SOFT, pulled(by=(0.0, 0.0, 0.05)))


def test_a_grip_beside_the_body_is_refused():
    motion = pulled()
    far = type(motion)(motion.center_rest + 1.0, *[getattr(motion, n) for n in list(motion.__dict__)[1:]])
    with pytest.raises(Problem, match=r"grip 0 .* lies outside the body; the nearest tissue is 1\.\d+ m away"):
        prepared()[0].drive(far, SOFT, fps=FPS, per_frame=10)


def test_a_step_too_large_names_the_largest_stable_one():
    with pytest.raises(Problem, match=r"largest stable one is 1\.000e-03 s"):
        check_step(2e-3, 1e-3)


def test_a_cut_lets_the_two_sides_part():
    body = slab()
    begin, end = np.array([0.0, -0.018, 0.06]), np.array([0.0, 0.018, 0.06])
    cut = Cut(begin, end, 0.012)
    whole, _ = prepared()
    parted, _ = prepared(cut=cut)
    motion, aside = pulled(by=(0.004, 0.0, -0.004)), np.array([0.008, 0.0, 0.0])
    motion = type(motion)(
        motion.center_rest + aside, motion.radius, motion.position + aside, motion.active,
        motion.confidence, "given",
    )  # fmt: skip
    gaps = []
    for made in (whole, parted):
        out, _ = run(made, body, SOFT, motion)
        full = made.simulator.displaced(out.u[6])
        nodes, weight, _ = made.simulator.stencil(np.array([[-0.0005, 0.0, 0.0605], [0.0005, 0.0, 0.0605]]))
        moved = np.einsum("qk,qka->qa", weight, full[nodes])
        gaps.append(np.linalg.norm(moved[1] - moved[0]))
    assert gaps[1] > 5 * gaps[0]
