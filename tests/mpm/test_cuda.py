"""The GPU's gather and the CPU's scatter are one method; needs a GPU, skips without."""

import numpy as np
import pytest
import warp as wp
from slab import pulled, slab

from surgisim.estimation.trial import at_once
from surgisim.mpm.setup import prepare

VALUES = {"corotated": {"E": 1500.0, "nu": 0.42}, "newtonian": {"eta": 2.0}}

pytestmark = pytest.mark.skipif(not wp.is_cuda_available(), reason="no CUDA device: GPU kernels are not tested here")


def one(device):
    body, motion = slab(), pulled()
    made = prepare(body, tuple(VALUES), density=1050.0, device=device)
    path = made.drive(motion, VALUES, fps=25.0, per_frame=made.per_frame(VALUES, 25.0))
    theta = made.theta(VALUES)
    run = made.simulator.run(theta, path)
    weight = np.random.default_rng(0).standard_normal(run.u.shape)
    return run.u, made.simulator.gradient(theta, path, run, weight).theta


def test_both_devices_move_the_body_alike_and_agree_on_the_gradient():
    (u, gradient), (u_gpu, gradient_gpu) = one("cpu"), one("cuda")
    assert np.abs(u_gpu - u).max() < 1e-4 * np.abs(u).max()
    assert np.linalg.norm(gradient_gpu - gradient) < 1e-2 * np.linalg.norm(gradient)


def test_two_runs_on_a_gpu_give_the_same_bytes():
    assert one("cuda")[0].tobytes() == one("cuda")[0].tobytes()


def test_threads_side_by_side_get_what_one_alone_does():
    (alone, gradient), several = one("cuda"), at_once(lambda device, _: one(device), ["cuda"] * 6, 3)
    for u, theirs in several:
        assert u.tobytes() == alone.tobytes()
        assert theirs.tobytes() == gradient.tobytes()
