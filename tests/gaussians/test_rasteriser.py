"""What the rasteriser draws."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import torch
from clouds import NAMES, TOLERANCE, camera, cloud, distance, one, together
from numba import njit
from scipy.spatial.transform import Rotation

from surgisim.gaussians import tiles
from surgisim.gaussians.blending import exp_negative
from surgisim.gaussians.engine_gsplat import lacking
from surgisim.gaussians.rasterise import rasterise, render, render_factors, to_bytes
from surgisim.problem import Problem

VIEW = camera(48, 40)
BACK = (0.2, 0.5, 0.7)


@pytest.mark.parametrize("size", [(61, 47), (64, 48), (161, 127), (5, 3), (1, 1)])
def test_the_cpu_engine_draws_what_the_twin_draws(size):
    view = camera(*size)
    scene = cloud(200, view)
    fast = rasterise(*scene, view, background=BACK)
    slow = rasterise(*(t.double() for t in scene), view, background=BACK, engine="twin")
    for name in ("rgb", "depth", "alpha", "weight"):
        assert distance(getattr(fast, name), getattr(slow, name)) < TOLERANCE["forward"], name


def test_many_layers_that_hide_each_other_are_drawn_as_the_twin_draws_them():
    # Dense and opaque: every pixel stops early, long before its list ends.
    scene = cloud(600, VIEW, seed=3)
    scene[2], scene[3] = scene[2] * 6, torch.full((600,), 0.97)
    fast = rasterise(*scene, VIEW)
    slow = rasterise(*(t.double() for t in scene), VIEW, engine="twin")
    assert distance(fast.rgb, slow.rgb) < TOLERANCE["forward"]
    assert float((1 - fast.alpha).max()) < 1e-4
    assert int((fast.weight == 0).sum()) > 300


def test_a_gaussian_is_brightest_at_its_pixel_and_alike_around_it():
    image = rasterise(*one(VIEW, at=(20.0, 15.0)), VIEW).alpha
    assert float(image[15, 20]) == pytest.approx(0.8, abs=1e-6)
    assert int(image.argmax()) == 15 * VIEW.width + 20
    assert torch.allclose(image[15, 10:20].flip(0), image[15, 21:31], atol=1e-3)


def test_depth_over_alpha_is_the_distance():
    seen = rasterise(*one(VIEW, z=0.06), VIEW)
    assert torch.allclose(seen.depth, 0.06 * seen.alpha, rtol=1e-6)


def test_moving_the_principal_point_by_a_pixel_moves_the_image_by_a_pixel():
    scene = one(VIEW, radius=2.0)
    here, there = (rasterise(*scene, replace(VIEW, cx=VIEW.cx + step)).rgb for step in (0, 1))
    assert torch.allclose(here[:, :-1], there[:, 1:], atol=1e-6)


def test_the_nearer_of_two_hides_the_other_whatever_their_order():
    near, far = one(VIEW, z=0.05, color=(1.0, 0, 0)), one(VIEW, z=0.06, color=(0, 1.0, 0))
    for scene in (together(near, far), together(far, near)):
        rgb = rasterise(*scene, VIEW).rgb[15, 20]
        assert torch.allclose(rgb, torch.tensor([0.8, 0.2 * 0.8, 0]), atol=1e-5)


def test_equally_near_gaussians_keep_their_order():
    red, green = one(VIEW, color=(1.0, 0, 0)), one(VIEW, color=(0, 1.0, 0))
    first, second = (rasterise(*together(*pair), VIEW).rgb[15, 20] for pair in ((red, green), (green, red)))
    assert first[0] > first[1]
    assert second[1] > second[0]


def test_the_length_and_sign_of_a_quaternion_do_not_matter():
    scene = cloud(50, VIEW)
    turned = [*scene]
    turned[1] = -3 * scene[1]
    assert torch.allclose(rasterise(*scene, VIEW).rgb, rasterise(*turned, VIEW).rgb, atol=1e-6)


def test_weights_add_up_to_alpha():
    seen = rasterise(*cloud(300, camera(161, 127)), camera(161, 127))
    assert float(seen.weight.sum()) == pytest.approx(float(seen.alpha.sum()), rel=1e-5)


@pytest.mark.parametrize("away", ["behind", "beside", "none", "thin"])
def test_what_is_out_of_view_leaves_the_background(away):
    scene = one(VIEW)
    if away == "behind":
        scene[0] = -scene[0]
    elif away == "beside":
        scene[0] = scene[0] + torch.tensor([1.0, 0, 0])
    elif away == "thin":
        scene[3] = torch.zeros(1)
    else:
        scene = [t[:0] for t in scene]
    seen = rasterise(*scene, VIEW, background=BACK)
    assert torch.equal(seen.rgb, torch.tensor(BACK).expand_as(seen.rgb))
    assert not seen.alpha.any()
    assert not seen.weight.any()


def test_a_huge_gaussian_covers_everything():
    alpha = rasterise(*one(VIEW, radius=1e5, opacity=0.9), VIEW).alpha
    assert torch.allclose(alpha, torch.full_like(alpha, 0.9), atol=1e-5)


def test_a_gaussian_of_no_size_is_as_wide_as_the_low_pass():
    alpha = rasterise(*one(VIEW, radius=0.0, opacity=0.5), VIEW).alpha
    assert float(alpha[15, 21]) == pytest.approx(0.5 * np.exp(-0.5 / 0.3), rel=1e-4)


def test_numpy_arrays_are_drawn_as_tensors_are():
    scene = cloud(50, VIEW)
    seen = render(*(t.numpy() for t in scene), VIEW, background=BACK)
    assert np.array_equal(seen.rgb, rasterise(*scene, VIEW, background=BACK).rgb.numpy())
    assert np.array_equal(to_bytes(np.array([-0.1, 0.5, 1.2])), [0, 128, 255])


def test_the_exponential_is_good_to_a_millionth():
    @njit
    def all_of(x, y):
        for i in range(len(x)):
            y[i] = exp_negative(x[i])

    x = np.linspace(0, 80, 200_001, dtype=np.float32)
    y = np.empty_like(x)
    all_of(x, y)
    truth = np.exp(-x.astype(np.float64))
    assert np.abs(y - truth).max() < 2e-7
    assert (np.abs(y - truth) / truth)[x < 20].max() < 3e-6


DIGEST = """
import hashlib, torch
from clouds import camera, cloud
from surgisim.gaussians.rasterise import rasterise
view = camera(161, 127)
scene = [t.requires_grad_() for t in cloud(500, view)]
seen = rasterise(*scene, view)
(seen.rgb.square().sum() + seen.depth.sum()).backward()
parts = [seen.rgb, seen.depth, seen.alpha, seen.weight] + [t.grad for t in scene]
print(hashlib.sha256(b"".join(p.detach().numpy().tobytes() for p in parts)).hexdigest())
"""


def test_the_number_of_threads_does_not_change_a_byte():
    def digest(threads):
        here = {"PYTHONPATH": os.path.dirname(__file__), "NUMBA_NUM_THREADS": str(threads), "OMP_NUM_THREADS": "1"}
        run = subprocess.run([sys.executable, "-c", DIGEST], env=os.environ | here, capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
        return run.stdout

    alone = digest(1)
    assert len(alone.strip()) == 64
    assert alone == digest(3)


@pytest.mark.parametrize("name", NAMES)
def test_a_nan_is_refused_and_named(name):
    scene = cloud(9, VIEW)
    scene[NAMES.index(name)][4] = float("nan")
    with pytest.raises(Problem, match=rf"{name} is not finite for 1 of 9 Gaussians, first 4"):
        rasterise(*scene, VIEW)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("opacity", torch.full((9,), 1.5), "opacity runs from 1.5 to 1.5"),
        ("rotation", torch.zeros(9, 4), "a rotation is 0, 0, 0, 0"),
        ("scale", torch.ones(8, 3), r"scale has shape \(8, 3\), and \(9, 3\) is wanted"),
        ("color", torch.ones(9, 3, dtype=torch.float64), "wants float32 on the CPU"),
    ],
)
def test_what_cannot_be_drawn_is_refused(name, value, words):
    scene = cloud(9, VIEW)
    scene[NAMES.index(name)] = value
    with pytest.raises(Problem, match=words):
        rasterise(*scene, VIEW)


def test_gaussians_too_large_for_the_memory_are_refused(monkeypatch):
    monkeypatch.setattr(tiles, "MOST_ENTRIES", 100)
    with pytest.raises(Problem, match=r"Gaussians cover \d+ tiles, and at most 100 fit"):
        rasterise(*cloud(300, VIEW), VIEW)


@pytest.mark.skipif(not lacking(), reason="this machine can run gsplat")
def test_without_cuda_the_other_engine_is_named():
    with pytest.raises(Problem, match=r"engine gsplat needs .* Use engine numba"):
        rasterise(*cloud(9, VIEW), VIEW, engine="gsplat")


GPU = pytest.mark.skipif(bool(lacking()), reason=f"gsplat needs {lacking()}")


@pytest.mark.parametrize("device", ["cpu", pytest.param("cuda", marks=GPU)])
def test_a_covariances_factor_may_be_turned_as_one_likes(device):
    mean, rotation, scale, opacity, color = (t.numpy() for t in cloud(200, VIEW, seed=4))
    factor = Rotation.from_quat(rotation, scalar_first=True).as_matrix() * scale[:, None, :]
    factor = factor @ Rotation.random(len(mean), random_state=0).as_matrix()
    wanted = render(mean, rotation, scale, opacity, color, VIEW)
    rgb, alpha = render_factors(mean, factor, opacity, color, VIEW, device=device)
    allowed = TOLERANCE["forward"] if device == "cpu" else TOLERANCE["cuda"]
    assert distance(torch.from_numpy(rgb), torch.from_numpy(wanted.rgb)) < allowed
    assert distance(torch.from_numpy(alpha), torch.from_numpy(wanted.alpha)) < allowed


def test_a_factor_that_is_no_number_is_named():
    mean, _, _, opacity, color = (t.numpy() for t in cloud(5, VIEW))
    with pytest.raises(Problem, match="factor is not finite"):
        render_factors(mean, np.full((5, 3, 3), np.nan), opacity, color, VIEW)
