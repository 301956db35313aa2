"""The regularisers and which points count as neighbours."""

import numpy as np
import pytest
import torch

from surgisim.gaussians.losses import anisotropic, followed, masked_l1, structure, total_variation, trajectory
from surgisim.gaussians.neighbours import groups, nearest
from surgisim.measure.ssim import ssim
from surgisim.problem import Problem

rng = np.random.default_rng(4)
POINTS = rng.random((40, 3))
STEP = torch.tensor(rng.standard_normal((40, 3)))
SCALE = torch.tensor(np.exp(rng.standard_normal((40, 3))))
GROUPS = torch.tensor(groups(POINTS, 5))


def test_round_small_gaussians_cost_nothing():
    assert float(anisotropic(torch.full((5, 3), 0.01), unit=0.01)) == 0
    assert float(anisotropic(torch.tensor([[0.01, 0.003, 0.0034]]), unit=0.01, r_ani=3.34)) == 0


def test_what_is_too_large_or_too_thin_costs_its_excess():
    assert float(anisotropic(torch.tensor([[0.5, 0.5, 0.2]], dtype=torch.float64), unit=0.1)) == pytest.approx(4)
    thin = torch.tensor([[0.5, 0.1, 0.2]], dtype=torch.float64)
    assert float(anisotropic(thin, unit=1.0)) == pytest.approx(2)
    assert float(anisotropic(thin, unit=0.1, r_m=2.0)) == pytest.approx(3 + 2)


def test_points_are_asked_to_be_where_they_were_seen_and_only_as_far_as_that_is_sure():
    went = torch.tensor([[3.0, 0.0], [0.0, -4.0], [50.0, 50.0]], dtype=torch.float64)
    moved = torch.tensor([[3.0, 0.0], [6.0, 4.0], [0.0, 0.0]], dtype=torch.float64, requires_grad=True)
    sure = torch.tensor([1.0, 0.5, 0.0], dtype=torch.float64)
    loss = followed(moved, went, sure, unit=2.0, soft=1e-6)
    assert loss.item() == pytest.approx(0.5 * 5 / 1.5)
    loss.backward()
    assert moved.grad[1].numpy() == pytest.approx(np.array([0.6, 0.8]) / 2 * 0.5 / 1.5)
    assert not moved.grad[[0, 2]].any()
    assert torch.autograd.gradcheck(lambda m: followed(m, went, sure, unit=2.0), (moved + 0.3,))
    assert followed(moved, went, 0 * sure, unit=2.0).item() == 0


def test_the_trajectory_term_is_the_sum_over_all_pairs():
    pairs = [(STEP[j], STEP[k]) for group in GROUPS for j in group for k in group]
    apart = sum((a - b).square().sum() for a, b in pairs) / len(pairs)
    along = sum(a @ b for a, b in pairs) / len(pairs)
    assert torch.allclose(trajectory(STEP, GROUPS), apart)
    assert torch.allclose(trajectory(STEP, GROUPS, literal=True), along)


def test_moving_alike_is_free_and_moving_apart_is_not():
    alike, apart = torch.ones(2, 3), torch.tensor([[1.0, 0, 0], [-1, 0, 0]])
    pair = torch.tensor([[0, 1]])
    assert float(trajectory(alike, pair)) == 0
    assert float(trajectory(apart, pair)) == pytest.approx(2)


def test_the_printed_trajectory_term_has_it_the_other_way_round():
    alike, apart = torch.ones(2, 3), torch.tensor([[1.0, 0, 0], [-1, 0, 0]])
    pair = torch.tensor([[0, 1]])
    assert float(trajectory(alike, pair, literal=True)) == pytest.approx(3)
    assert float(trajectory(apart, pair, literal=True)) == 0


def test_total_variation_is_the_mean_jump():
    value = torch.tensor([0.0, 1.0, 3.0])
    assert float(total_variation(value, torch.tensor([[1], [0], [1]]))) == pytest.approx((1 + 1 + 2) / 3)
    assert float(total_variation(torch.ones(3, 2), torch.tensor([[1], [2], [0]]))) == 0


def test_the_picture_counts_only_under_the_mask():
    value, target = torch.zeros(2, 2, 3), torch.ones(2, 2, 3)
    target[0, 0] = 5
    assert float(masked_l1(value, target, torch.tensor([[False, True], [True, True]]))) == 1
    assert float(masked_l1(value[..., 0], target[..., 0], torch.tensor([[True, False], [False, False]]))) == 5
    assert float(masked_l1(value, target, torch.zeros(2, 2, dtype=torch.bool))) == 0


@pytest.mark.parametrize(
    "loss",
    [
        lambda v: anisotropic(v.exp(), unit=0.5),
        lambda v: trajectory(v, GROUPS),
        lambda v: trajectory(v, GROUPS, literal=True),
        lambda v: total_variation(v, GROUPS[:, 1:]),
        lambda v: masked_l1(v.reshape(5, 8, 3), torch.zeros(5, 8, 3), torch.ones(5, 8)),
    ],
    ids=["anisotropic", "trajectory", "literal", "total variation", "masked l1"],
)
def test_gradients_are_central_differences(loss):
    assert torch.autograd.gradcheck(loss, STEP.clone().requires_grad_())


def test_neighbours_are_the_nearest_others():
    far = np.linalg.norm(POINTS[:, None] - POINTS, axis=2)
    np.fill_diagonal(far, np.inf)
    assert np.array_equal(nearest(POINTS, 5), np.argsort(far, 1)[:, :5])
    assert np.array_equal(groups(POINTS, 5)[:, 0], np.arange(40))


def test_points_at_one_place_are_each_others_neighbours_and_never_their_own():
    found = nearest(np.zeros((6, 3)), 3)
    assert not (found == np.arange(6)[:, None]).any()
    assert all(len(set(row)) == 3 for row in found)
    assert np.array_equal(found, nearest(np.zeros((6, 3)), 3))


@pytest.mark.parametrize("k", [0, 4])
def test_more_neighbours_than_there_are_points_are_refused(k):
    with pytest.raises(Problem, match=rf"{k} neighbours are wanted for each of 4 points"):
        nearest(np.eye(4, 3), k)


def test_structure_is_what_the_metric_says_of_pictures():
    reference = rng.integers(0, 256, (24, 31, 3)).astype(np.uint8)
    drawn = np.clip(reference + rng.normal(0, 25, reference.shape), 0, 255).astype(np.uint8)
    # Black around both: what lies past an image's edge is made up, and by each otherwise.
    drawn, reference = (np.pad(a, [(6, 6), (6, 6), (0, 0)]) for a in (drawn, reference))
    whole = np.ones((1, *reference.shape[:2]))
    pair = (torch.tensor(a[None] / 255) for a in (drawn, reference))
    assert 1 - float(structure(*pair, torch.tensor(whole))) == pytest.approx(
        ssim(drawn, reference, whole[0] > 0), abs=1e-6
    )


def test_structure_counts_nothing_of_what_does_not_count():
    drawn, seen = torch.rand(2, 2, 16, 20, 3, dtype=torch.float64).unbind(0)
    mask = torch.zeros(2, 16, 20, dtype=torch.float64)
    mask[:, :, :10] = 1
    other = torch.where(mask[..., None] > 0, drawn, torch.rand_like(drawn))
    assert float(structure(drawn, seen, mask)) == float(structure(other, seen, mask)) > 0.1
    assert float(structure(drawn, seen, 0 * mask)) == 0
    assert float(structure(seen, seen, mask)) == pytest.approx(0, abs=1e-12)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU")
def test_structure_is_the_same_on_cuda():
    drawn = torch.rand(2, 40, 50, 3) * 0.02 + 0.7
    seen, mask = (drawn + 0.005 * torch.randn_like(drawn)).clamp(0, 1), torch.rand(2, 40, 50)
    there = structure(drawn.cuda(), seen.cuda(), mask.cuda())
    assert float(there) == pytest.approx(float(structure(*(a.double() for a in (drawn, seen, mask)))), abs=1e-4)


def test_the_slope_of_structure_is_that_of_differences():
    drawn, seen = torch.rand(2, 1, 12, 13, 1, dtype=torch.float64).unbind(0)
    mask = torch.rand(1, 12, 13, dtype=torch.float64)
    assert torch.autograd.gradcheck(lambda image: structure(image, seen, mask), (drawn.requires_grad_(),))
