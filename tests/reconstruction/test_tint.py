"""What light does to colours is learned as such, and moves the surface hardly more than where colours have to stay."""

from dataclasses import replace

import numpy as np
import pytest
from test_reconstruct import parts

from surgisim.deformation.field import displace, load_field
from surgisim.gaussians.play import Play
from surgisim.gaussians.reconstruct import reconstruct
from surgisim.gaussians.tint import clock, knots, shares


@pytest.mark.parametrize("count", [1, 4, 7])
def test_shares_begin_at_nothing_and_go_on_evenly(count):
    clocks = np.linspace(0, 1, 50)
    total = np.array([sum(shares(c, count).values()) for c in clocks])
    assert total[0] == 0
    assert np.allclose(total, np.minimum(clocks * count, 1.0))
    assert shares(1.0, count) == {count - 1: 1.0}


def test_colours_at_a_knot_are_its_own_and_between_two_the_middle(fit):
    at_knots = np.random.default_rng(0).normal(size=(5, len(fit.adam.tensors["mean"]), 3)).astype(np.float16)
    scene, field, _ = fit.result()
    play = Play(scene, field, np.array([0, 0.5, 1.0]), at_knots, fit.camera)
    assert np.allclose(play.colors(0.4), scene.color + at_knots[1], atol=1e-6)
    assert np.allclose(play.colors(0.5), scene.color + (at_knots[1] + at_knots[2].astype(float)) / 2, atol=1e-3)
    assert np.array_equal(play.colors(0.0), scene.color)


def test_what_lies_between_two_frames_that_are_looked_at_is_half_way():
    moments = np.array([0, 1, 2, 4, 5]) / 25
    assert [clock(t / 25, moments) for t in (0, 1, 3, 5)] == pytest.approx([0, 0.25, 0.625, 1])
    assert clock(0.3, moments[:1]) == 0


def test_scales_are_one_at_the_frames_that_are_looked_at(fit):
    for k, name in enumerate(fit.tint):
        fit.adam.tensors[name] += 0.01 * (k + 1)
    scene, field, at_knots = fit.result()
    play = Play(scene, field, fit.moments, at_knots, fit.camera)
    assert len(at_knots) == len(fit.moments) - 1 > len(fit.tints[0])
    for time in fit.moments:
        gone = clock(time, fit.moments)
        assert np.allclose(play.colors(time), scene.color + fit.added([gone])[0].numpy(), atol=1e-6)


def test_there_are_knots_for_any_clip():
    assert [knots(0.3, n) for n in (1, 2, 11, 158)] == [1, 1, 3, 47]


def test_a_light_that_comes_is_learned_and_moves_hardly_more_than_without(clip):
    """The right half grows brighter through the clip; nothing but colours can tell."""
    count, height, width = clip.depth.z.shape
    still = np.repeat(clip.inpainted.rgb[:1], count, 0).astype(float)
    lit = np.where(np.arange(width) > width / 2, 1 + 0.5 * np.linspace(0, 1, count)[:, None], 1.0)[:, None, :, None]
    rgb = np.rint(np.clip(still * lit, 0, 255)).astype(np.uint8)
    inpainted = replace(clip.inpainted, rgb=rgb, origin=np.zeros_like(clip.inpainted.origin))
    masks = replace(clip.masks, tool=clip.masks.tool & False, tissue=np.ones_like(clip.masks.tissue))
    wrong, moved = {}, {}
    for tint in (0.01, 1e3):
        settings = clip.settings.model_copy(update={"tint": tint})
        done = reconstruct(*parts(clip, inpainted=inpainted, masks=masks, settings=settings))
        held = clip.frames.split == 1
        wrong[tint] = np.mean((done.rendered.rgb[held] / 255 - rgb[held] / 255) ** 2)
        start = np.stack(np.mgrid[8 : width - 8 : 4, 8 : height - 8 : 4], -1).reshape(-1, 2).astype(float)
        rest = clip.camera.lift(start, np.full(len(start), clip.z))
        there = displace(rest, load_field(done.deformation), (count - 1) / clip.camera.fps)
        moved[tint] = np.median(np.linalg.norm(clip.camera.project(there) - start, axis=1))
    assert wrong[0.01] < 0.5 * wrong[1e3]
    assert moved[0.01] < 1.2 * moved[1e3]
