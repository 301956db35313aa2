from dataclasses import replace

import numpy as np
import pytest
import torch

from surgisim.artifacts.scene import Scene
from surgisim.deformation.field import displace, load_field, save_field, still_field
from surgisim.deformation.smoothness import roughness
from surgisim.problem import Problem

rng = np.random.default_rng(0)
LOW, HIGH = np.array([-0.02, -0.02, 0.04, 0.0]), np.array([0.02, 0.02, 0.06, 1.0])


@pytest.fixture
def still():
    return still_field(LOW, HIGH, np.array([[5, 4, 3, 4], [9, 8, 5, 7]]), 4, 12, rng)


@pytest.fixture
def moving(still):
    return replace(still, planes=torch.tensor(rng.uniform(0.5, 1.5, still.layout.count), dtype=torch.float32))


@pytest.fixture
def scene():
    f = np.float32
    turn = rng.standard_normal((30, 4))
    return Scene(
        mean=rng.uniform(LOW[:3], HIGH[:3], (30, 3)).astype(f),
        opacity=rng.standard_normal(30).astype(f),
        scale=rng.uniform(-8, -6, (30, 3)).astype(f),
        rotation=(turn / np.linalg.norm(turn, axis=1, keepdims=True)).astype(f),
        color=rng.random((30, 3)).astype(f),
    )


def test_a_new_field_moves_nothing(still, scene):
    assert np.array_equal(displace(scene.mean, still, 0.7), scene.mean)


def test_a_new_field_can_start_to_move(still, scene):
    planes = still.planes.clone().requires_grad_()
    field = replace(still, planes=planes)
    field(torch.from_numpy(scene.mean), 0.7)[0].sum().backward()
    assert planes.grad.abs().max() > 0


def test_frame_0_is_the_canonical_scene(moving, scene):
    mean = torch.from_numpy(scene.mean)
    assert not any(change.any() for change in moving(mean, 0.0))
    assert not np.allclose(displace(scene.mean, moving, 0.5), scene.mean, atol=1e-5)


def test_points_move_with_the_gaussians_at_their_place(moving, scene):
    moved = moving(torch.from_numpy(scene.mean), 0.3)[0].detach().numpy()
    assert np.allclose(displace(scene.mean, moving, 0.3), scene.mean + moved, atol=1e-7)


def test_a_stored_field_moves_like_the_one_it_was(moving, scene):
    again = load_field(save_field(moving, np.zeros(1), np.zeros((1, 4, 3)), np.zeros((2, 5))))
    assert np.allclose(displace(scene.mean, again, 0.4), displace(scene.mean, moving, 0.4), atol=1e-6)


def test_a_field_whose_layout_does_not_fit_is_refused(moving):
    stored = save_field(moving, np.zeros(1), np.zeros((1, 4, 3)), np.zeros((2, 5)))
    with pytest.raises(Problem, match="announces"):
        load_field(replace(stored, planes=stored.planes[:-1]))


def test_several_times_at_once_are_those_times(moving, scene):
    mean, times = torch.from_numpy(scene.mean), [0.3, 0.0, 0.9, 0.3]
    for several, each in zip(moving.at(mean, times), zip(*(moving(mean, t) for t in times), strict=True), strict=True):
        torch.testing.assert_close(several, torch.stack(each), rtol=1e-5, atol=1e-6)
    assert moving.at(mean, times)[0][0].abs().max() > 0
    assert moving.at(mean, times)[0][1].abs().max() == 0


def test_planes_that_change_evenly_in_time_are_smooth_there(still):
    layout, planes = still.layout, still.planes.clone()
    assert all(float(v) == 0 for v in roughness(planes, layout))
    tx = layout.plane(planes, 0, 3)
    tx += torch.arange(len(tx))[:, None, None]
    space, time = roughness(planes, layout)
    assert float(time) < 1e-10
    assert float(space) == 0
    tx[2] += 1
    assert float(roughness(planes, layout)[1]) > 0.1
