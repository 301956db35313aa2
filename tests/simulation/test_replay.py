"""A replay carries the body, its picture and its numbers together."""

from dataclasses import replace

import numpy as np
import pytest
from slab import pulled, slab

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.material import Material
from surgisim.artifacts.physics import Physics
from surgisim.artifacts.scene import Scene
from surgisim.config.simulation import Simulation
from surgisim.mpm.setup import prepare
from surgisim.problem import Problem
from surgisim.simulation.replay import replay

CAMERA = Camera(64, 48, 80.0, 80.0, 31.5, 23.5, 25.0, 14, "known", "given", "slab", [64, 48], [0, 0, 64, 48])
VALUES = {"corotated": {"E": 1500.0, "nu": 0.42}, "newtonian": {"eta": 2.0}}
UNITS = {"E": "Pa", "nu": "1", "eta": "Pa s"}


def silent(*_):
    pass


def fitted(body, step=None):
    made = prepare(body, tuple(VALUES), density=1050.0)
    step = step or 1 / 25.0 / made.per_frame(VALUES, 25.0)
    terms = {law: {p: {"value": v, "unit": UNITS[p]} for p, v in ps.items()} for law, ps in VALUES.items()}
    physics = Physics(terms, 1050.0, [0.0, 0.0, 0.0], {"spacing": body.spacing, "step": step})
    names = np.array(["corotated.E", "corotated.nu", "newtonian.eta"])
    return Material(names, np.tile([1500.0, 0.42, 2.0], (len(body.rest), 1)).astype(np.float32), body.held), physics


def splats(body):
    top = body.rest[body.surface]
    n = len(top)
    stripes = np.where((top[:, :1] // 0.004) % 2 > 0, 0.9, 0.2)
    return Scene(
        top - [0, 0, body.spacing / 4], np.full(n, 4.0), np.full((n, 3), np.log(0.0016)),
        np.tile([1.0, 0, 0, 0], (n, 1)), np.concatenate([stripes, 0.5 * stripes, 0.5 * stripes], 1),
    )  # fmt: skip


def test_the_recorded_pull_is_followed_by_body_nodes_and_picture():
    body = slab()
    out = replay(body, splats(body), *fitted(body), pulled(frames=14), CAMERA, Simulation(), silent)
    near = np.linalg.norm(body.rest - [0, 0, 0.06], axis=1).argmin()
    assert np.allclose(out.position[8, near] - body.rest[near], [0.003, 0, -0.006], atol=8e-4)
    assert out.rgb.shape == (14, 48, 64, 3)
    assert np.abs(out.rgb[8].astype(int) - out.rgb[0]).max() > 50
    assert out.smallest_volume_ratio.min() > 0
    assert out.energy[8, 1] > 0
    assert np.allclose(out.position[0], body.rest, atol=1e-6)


def test_a_cut_opens_where_it_is_made_and_leaves_the_rest():
    body = slab()
    by = {"act": "pull", "at": [44, 23.5], "by": [0.004, 0, -0.003], "begin": 0.0, "end": 0.3}
    slit = {"act": "cut", "along": [[31.5, 2], [31.5, 45]], "depth": 0.012}
    gaps = []
    for do in ([by], [by, slit]):
        settings = Simulation(operation={"seconds": 0.5, "do": do}, render=False)
        out = replay(body, splats(body), *fitted(body), pulled(), CAMERA, settings, silent)
        top = body.rest[:, 2] < 0.063
        row = top & (np.abs(body.rest[:, 1]) < 0.003)
        left = row & (body.rest[:, 0] < 0) & (body.rest[:, 0] > -0.003)
        right = row & (body.rest[:, 0] > 0) & (body.rest[:, 0] < 0.003)
        gaps.append(out.position[-1, right, 0].mean() - out.position[-1, left, 0].mean())
    assert gaps[1] > gaps[0] + 5e-4


def test_a_step_too_large_for_the_tissue_is_refused_before_anything_runs():
    body = slab()
    with pytest.raises(Problem, match="largest stable one is"):
        replay(body, splats(body), *fitted(body, step=0.02), pulled(), CAMERA, Simulation(), silent)


def test_files_of_different_bodies_are_refused():
    body = slab()
    material, physics = fitted(body)
    with pytest.raises(Problem, match="particles"):
        replay(slab(size=(0.03, 0.03, 0.018)), splats(body), material, physics, pulled(), CAMERA, Simulation(), silent)
    other = replace(physics, grid={**physics.grid, "spacing": 0.004})
    with pytest.raises(Problem, match=r"was fitted on a grid of 0\.004"):
        replay(body, splats(body), material, other, pulled(), CAMERA, Simulation(), silent)


def hung(frames=14):
    """A slab that nothing but four patches of its face holds, which the recording carries 3 mm aside."""
    body = replace(slab(), held=np.zeros(len(slab().rest), bool))
    corners = np.array([[x, y, 0.06] for x in (-0.018, 0.018) for y in (-0.012, 0.012)])
    aside = np.linspace(0, 1, frames)[:, None] * [0.003, 0.0, 0.0]
    motion = replace(pulled(frames=frames), rim=corners[:, None] + aside, rim_radius=np.full(4, 0.006))
    return body, motion


def test_a_body_goes_where_its_edge_is_carried():
    body, motion = hung()
    aside = replace(motion, position=np.repeat(motion.position[:, :1], 14, 1), active=np.zeros((1, 14), bool))
    out = replay(body, splats(body), *fitted(body), aside, CAMERA, Simulation(render=False), silent)
    moved = (out.position[-1] - body.rest)[body.surface]
    assert np.allclose(np.median(moved, 0), [0.003, 0, 0], atol=3e-4)


def test_under_an_operation_such_a_body_stays_with_the_base():
    body, motion = hung()
    push = {"act": "pull", "at": [31.5, 23.5], "by": [0.0, 0.0, -0.003], "begin": 0.0, "end": 0.2}
    settings = Simulation(render=False, operation={"seconds": 0.5, "do": [push]})
    out = replay(body, splats(body), *fitted(body), motion, CAMERA, settings, silent)
    moved = out.position[-1] - body.rest
    middle = np.linalg.norm(body.rest - [0, 0, 0.06], axis=1).argmin()
    corner = np.linalg.norm(body.rest - [0.018, 0.012, 0.06], axis=1).argmin()
    assert moved[middle, 2] == pytest.approx(-0.003, abs=8e-4)
    assert np.linalg.norm(moved[corner]) < 5e-4


@pytest.mark.parametrize("solver", ["point_cloud", "mesh"])
def test_masses_and_springs_follow_the_same_pull(solver):
    body = slab()
    out = replay(body, splats(body), *fitted(body), pulled(frames=14), CAMERA, Simulation(solver=solver), silent)
    near = np.linalg.norm(body.rest - [0, 0, 0.06], axis=1).argmin()
    assert np.allclose(out.position[8, near] - body.rest[near], [0.003, 0, -0.006], atol=1.5e-3)
    held = np.linalg.norm(out.position[8] - body.rest, axis=1)[body.held]
    assert held.max() < 0.3e-3 + 0.1 * 0.0067
    assert out.energy[8, 1] > 0 == out.energy[0, 1]
    assert np.allclose(out.position[0], body.rest, atol=1e-6)
    assert np.abs(out.rgb[8].astype(int) - out.rgb[0]).max() > 50


def test_a_solver_that_is_none_and_a_cut_that_springs_cannot_make_are_said():
    body = slab()
    told = body, splats(body), *fitted(body), pulled(frames=14), CAMERA
    with pytest.raises(Problem, match=r"simulation.solver' is 'jelly'.*mesh.*point_cloud"):
        replay(*told, Simulation(solver="jelly"), silent)
    cut = {"seconds": 0.4, "do": [{"act": "cut", "along": [[31.5, 2], [31.5, 45]], "depth": 0.012}]}
    with pytest.raises(Problem, match="cannot cut"):
        replay(*told, Simulation(solver="mesh", operation=cut), silent)
