from dataclasses import replace

import numpy as np
import pytest
import torch

from surgisim.gaussians.adam import FIRST, SECOND, TINY, Adam
from surgisim.gaussians.densify import ATTRIBUTES, Record, renew
from surgisim.gaussians.observations import observe
from surgisim.gaussians.reconstruct import threads
from surgisim.gaussians.schedule import PHASES, phase_at, rate_at
from surgisim.problem import Problem


def test_phases_end_where_the_paper_says():
    counts = np.bincount([phase_at(i, 5000, (0.5, 0.7, 0.9)).number for i in range(5000)])
    assert counts.tolist() == [0, 2500, 1000, 1000, 500]


def test_phases_out_of_order_are_refused():
    with pytest.raises(Problem, match="rising"):
        phase_at(0, 10, (0.7, 0.5, 0.9))


def test_rates_fall_to_their_end():
    assert rate_at(0, 100, 0.1) == 1
    assert np.isclose(rate_at(99, 100, 0.1), 0.1)


def test_an_instrument_that_was_not_painted_over_counts_nothing(clip):
    origin = np.zeros_like(clip.inpainted.origin)
    seen = observe(
        clip.frames, replace(clip.inpainted, origin=origin), clip.masks, clip.correspondence, clip.depth, clip.settings
    )
    tool = torch.from_numpy(clip.masks.tool[seen.frame])
    assert tool.any()
    assert not seen.weight[tool].any()
    assert (seen.weight[~tool] == 1).all()


def test_copied_and_invented_pixels_count_less(clip):
    origin = clip.inpainted.origin.copy()
    origin[5][origin[5] == 1] = 2
    seen = observe(
        clip.frames, replace(clip.inpainted, origin=origin), clip.masks, clip.correspondence, clip.depth, clip.settings
    )
    painted = torch.from_numpy(origin[seen.frame])
    assert (seen.weight[painted == 1] == torch.tensor(clip.settings.weight_copied)).all()
    assert (seen.weight[painted == 2] == torch.tensor(clip.settings.weight_invented)).all()


def test_held_out_frames_stay_outside_and_the_tail_comes_in(clip):
    seen = observe(clip.frames, clip.inpainted, clip.masks, clip.correspondence, clip.depth, clip.settings)
    assert sorted(seen.frame) == np.flatnonzero(clip.frames.split != 1).tolist()
    assert 2 in clip.frames.split[seen.frame]


def test_a_clip_whose_first_frame_is_held_out_is_refused(clip):
    split = clip.frames.split.copy()
    split[0] = 1
    with pytest.raises(Problem, match="frame 0"):
        observe(
            replace(clip.frames, split=split),
            clip.inpainted,
            clip.masks,
            clip.correspondence,
            clip.depth,
            clip.settings,
        )


def test_adam_steps_like_torch():
    rng = np.random.default_rng(0)
    start, target = (torch.tensor(rng.standard_normal((7, 3)), dtype=torch.float32) for _ in range(2))
    mine = Adam({"x": start}, {"x": 0.05})
    other = start.clone().requires_grad_()
    optimiser = torch.optim.Adam([other], lr=0.05, betas=(FIRST, SECOND), eps=TINY)
    for _ in range(20):
        mine.watch({"x"})
        (mine.tensors["x"] - target).square().sum().backward()
        mine.advance(1.0)
        optimiser.zero_grad()
        (other - target).square().sum().backward()
        optimiser.step()
    torch.testing.assert_close(mine.tensors["x"].detach(), other.detach(), rtol=1e-4, atol=1e-5)


def crowd(count):
    rng = np.random.default_rng(2)
    columns = {"mean": 3, "opacity": 0, "scale": 3, "rotation": 4, "color": 3}
    tensors = {
        name: torch.tensor(rng.standard_normal((count, n) if n else count), dtype=torch.float32)
        for name, n in columns.items()
    }
    tensors["scale"] -= 5
    tensors["opacity"].abs_()
    return Adam(tensors, dict.fromkeys(ATTRIBUTES, 0.1))


def test_faint_wide_and_unseen_gaussians_are_dropped():
    adam, record = crowd(20), Record.empty(20)
    record.shown += 1
    adam.tensors["opacity"][0] = -9
    adam.tensors["scale"][1, 2] = 1.0
    record.shown[2] = 0
    kept = adam.tensors["mean"][3:].clone()
    assert renew(adam, record, most=20, share=0.0, widest=0.5) == 17
    assert torch.equal(adam.tensors["mean"], kept)


def test_the_most_pulled_gaussian_is_split_in_two_around_its_place():
    adam, record = crowd(20), Record.empty(20)
    record.shown += 1
    record.pull[4] = 1.0
    place, size = adam.tensors["mean"][4].clone(), adam.tensors["scale"][4].clone()
    assert renew(adam, record, most=100, share=0.05, widest=9.0) == 21
    parts = adam.tensors["mean"][[4, 20]]
    assert torch.allclose(parts.mean(0), place, atol=1e-6)
    assert not torch.allclose(parts[0], parts[1])
    assert (adam.tensors["scale"][[4, 20]] < size).all()


def test_the_bound_on_their_number_holds():
    adam, record = crowd(20), Record.empty(20)
    record.shown += 1
    assert renew(adam, record, most=23, share=1.0, widest=9.0) == 23


def test_the_four_phases_are_those_of_the_paper():
    assert [(p.moves_canonical, p.moves_field, p.trajectory) for p in PHASES] == [
        (True, True, False),
        (True, True, True),
        (False, True, True),
        (True, False, False),
    ]


def test_two_threads_add_slopes_in_one_order():
    make = torch.Generator().manual_seed(0)
    many = torch.randint(0, 300, (400_000,), generator=make)
    slope, found = torch.randn(400_000, 3, generator=make), set()
    with threads(2, same_bytes=True):
        for _ in range(6):
            few = torch.ones(300, 3, requires_grad=True)
            (few[many] * slope).sum().backward()
            found.add(few.grad.numpy().tobytes())
    assert len(found) == 1
    assert not torch.are_deterministic_algorithms_enabled()
