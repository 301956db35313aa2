"""Tracking noise is told from quiet frames, and whitened away."""

import json
from dataclasses import replace

import numpy as np
import pytest
from planted import NOISE

from surgisim.diagnosis.metric import metric
from surgisim.diagnosis.noise import Noise, whitener
from surgisim.diagnosis.noise_fit import by_frame, estimate

FRAMES = 80


@pytest.fixture(scope="module")
def drawn():
    rng = np.random.default_rng(5)
    rest = np.append(rng.uniform(0, 0.04, (50, 2)), np.zeros((50, 1)), 1)
    noise = Noise(level=2e-4 * np.exp(0.2 * rng.standard_normal(50)), **NOISE)
    tracks = noise.draw(rest, FRAMES, rng) + 3e-4 * rng.standard_normal((50, 1, 3))
    seen = rng.random((50, FRAMES)) > 0.02
    return rest, noise, np.where(seen[..., None], tracks, 0.0), seen


def test_the_noise_that_was_drawn_is_found(drawn):
    rest, noise, tracks, seen = drawn
    found = estimate(tracks, seen, rest, np.ones(FRAMES, bool), np.full(50, 2e-4))
    assert found.sigma == pytest.approx(noise.sigma, rel=0.15)
    assert found.shared / (found.shared + found.lasting + found.white) == pytest.approx(0.3 / 0.95, abs=0.12)
    white = whitener(found, rest, seen)(tracks)
    freedom = 3 * (seen.sum() - 50)
    assert (white**2).sum() / freedom == pytest.approx(1.0, abs=0.1)


def told_from(noise, rest, signal):
    return float((whitener(noise, rest, np.ones(signal.shape[:2], bool))(signal) ** 2).sum())


@pytest.fixture(scope="module")
def white():
    """Points that err on their own, and what would show over one half of them in the last third of the frames."""
    rng = np.random.default_rng(9)
    rest = np.append(rng.uniform(0, 0.04, (60, 2)), np.zeros((60, 1)), 1)
    bump = np.exp(-0.5 * ((rest - rest[0]) ** 2).sum(1) / 0.012**2)
    signal = bump[:, None, None] * np.clip((np.arange(FRAMES) - 50) / 20, 0, 1)[:, None] * np.array([0, 0, 1e-4])
    return rest, 2e-4 * rng.standard_normal((60, FRAMES, 3)), signal


def told(white, moved=0.0, untouched=None):
    rest, tracks, _ = white
    still = np.ones(FRAMES, bool)
    return estimate(tracks + moved, np.ones((60, FRAMES), bool), rest, still, np.full(60, 2e-4), untouched=untouched)


def test_frames_that_nothing_has_touched_tell_white_noise_from_noise_that_lasts(white):
    rest, _, signal = white
    true = Noise(
        level=np.full(60, 2e-4), **NOISE | {"shared": 0.0, "rigid": 0.0, "tilt": 0.0, "lasting": 0.0, "white": 1.0}
    )
    most = told_from(true, rest, signal)
    moving, resting = (told_from(told(white, untouched=frames), rest, signal) / most for frames in (0, 50))
    assert moving < resting
    assert 0.4 < resting < 1.1


def test_what_breathes_before_anything_is_touched_is_no_noise(white):
    rest, *_ = white
    arm = (rest - rest.mean(0)) / 0.02
    breath = (1 + 0.5 * arm[:, 0] - 0.4 * arm[:, 1] ** 2)[:, None] * 1e-3 * np.sin(np.arange(FRAMES) / 6)
    still, breathing = told(white, untouched=FRAMES), told(white, breath[..., None] * AXES, untouched=FRAMES)
    assert breathing.sigma == pytest.approx(still.sigma, rel=0.1)
    # Of one place it is: there nobody could tell it from a tracker that wanders.
    here = np.exp(-0.5 * arm[:, 0] ** 2 / 0.3**2)[:, None] * 1e-3 * np.sin(np.arange(FRAMES) / 6)
    assert told(white, here[..., None] * AXES, untouched=FRAMES).sigma > 1.2 * still.sigma


AXES = np.sqrt([0.15, 0.15, 2.7])


def test_depth_that_is_less_sure_weighs_less(drawn):
    rest, noise, *_ = drawn
    uneven = replace(noise, axes=np.tile(AXES, (50, 1)))
    assert uneven.sigma == noise.sigma
    seen = np.random.default_rng(8).random((50, FRAMES)) > 0.02
    field = uneven.draw(rest, FRAMES, np.random.default_rng(7))
    white = whitener(uneven, rest, seen)(field).reshape(50, FRAMES, 3)
    assert (white**2).mean((0, 1)) == pytest.approx([1, 1, 1], abs=0.1)
    whiten = whitener(uneven, rest, seen)
    other = np.random.default_rng(9).standard_normal(field.shape)
    assert whiten(other) @ whiten(field) == pytest.approx((other * whiten.back(whiten(field))).sum())


def ways(count):
    """A third direction that leans another way for each point, and two across it."""
    along = np.stack([np.linspace(-0.4, 0.4, count), np.linspace(0.3, -0.2, count), np.ones(count)], 1)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    right = np.cross([0.0, 1.0, 0.0], along)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    return np.stack([right, np.cross(along, right), along], 1)


def test_what_is_less_sure_along_a_points_own_way_weighs_less_there(drawn):
    rest, noise, *_ = drawn
    turned = replace(noise, axes=np.tile(AXES, (50, 1)), ways=ways(50))
    field = turned.draw(rest, FRAMES, np.random.default_rng(7))
    seen = np.ones((50, FRAMES), bool)
    whiten = whitener(turned, rest, seen)
    white = whiten(field).reshape(50, FRAMES, 3)
    assert (white**2).mean((0, 1)) == pytest.approx([1, 1, 1], abs=0.1)
    other = np.random.default_rng(9).standard_normal(field.shape)
    assert whiten(other) @ whiten(field) == pytest.approx((other * whiten.back(whiten(field))).sum())
    along, across = (np.linspace(0, 1e-3, FRAMES)[:, None] * turned.ways[:, None, a] for a in (2, 0))
    assert (whiten(along) ** 2).sum() == pytest.approx(0.15 / 2.7 * (whiten(across) ** 2).sum())
    # The same with axes along the frame lets what is not known of one axis hide what is known of the others.
    level = np.einsum("kai,ka->ki", turned.ways**2, turned.axes**2)
    straight = whitener(replace(turned, axes=np.sqrt(level), ways=None), rest, seen)
    assert (straight(across) ** 2).sum() < 0.8 * (whiten(across) ** 2).sum()
    assert turned.told_of(across) == pytest.approx(across)
    assert turned.told_of(along) == pytest.approx(np.sqrt(0.15 / 2.7) * along)
    found = estimate(field, seen, rest, np.ones(FRAMES, bool), np.full(50, 2e-5), turned.axes, turned.ways)
    assert found.sigma == pytest.approx(noise.sigma, rel=0.15)
    assert found.ways is turned.ways


@pytest.mark.parametrize("axes", [None, np.tile(AXES, (50, 1))])
def test_it_is_told_in_plain_numbers_whether_axes_are_alike_or_not(drawn, axes):
    _, noise, *_ = drawn
    told = replace(noise, axes=axes).told()
    assert json.loads(json.dumps(told)) == told
    assert told["axes"] == (None if axes is None else pytest.approx(AXES.tolist()))


def test_frames_in_which_each_point_is_off_by_its_own_count_less(drawn):
    rest, noise, tracks, seen = drawn
    swept = np.sin(np.arange(FRAMES) / 9) * np.exp(-((rest[:, :1] - 0.02) ** 2) / 0.01**2)
    blurred = (np.arange(FRAMES) >= 10) & (np.arange(FRAMES) < 20)
    field = tracks + 5e-3 * swept[..., None] * AXES
    field += 4 * noise.sigma * np.random.default_rng(9).standard_normal(field.shape) * blurred[:, None]
    found = by_frame(noise, field, seen)
    own = noise.sigma**2 / (noise.level**2).mean()
    assert found.rough[blurred] == pytest.approx(16 * own, rel=0.35)
    assert found.rough[~blurred].max() < own
    assert whitener(found, rest, seen)(tracks).std() < whitener(noise, rest, seen)(tracks).std()
    assert json.loads(json.dumps(found.told()))["rough"] == pytest.approx(found.rough.mean())


def test_a_constant_of_a_point_is_no_residual(drawn):
    rest, noise, _, seen = drawn
    whiten = whitener(noise, rest, np.ones_like(seen))
    constant = np.broadcast_to(np.random.default_rng(0).standard_normal((50, 1, 3)), (50, FRAMES, 3))
    assert np.abs(whiten(constant)).max() < 1e-9


def dense(noise, rest, frames):
    axes, shared, camera = noise.modes(rest)
    cov = np.einsum("km,mts,lm->ktls", axes, noise.temporal(frames, shared, camera), axes)
    return cov.reshape(len(rest) * frames, -1) * np.outer(*[np.repeat(noise.level, frames)] * 2)


@pytest.mark.parametrize("share", [0.02, 0.3])
def test_missing_samples_are_marginalised_exactly(drawn, share):
    rest, noise, tracks, _ = drawn
    rest, tracks, frames = rest[:12], tracks[:12, :20], 20
    noise = Noise(**{**vars(noise), "level": noise.level[:12]})
    seen = np.random.default_rng(3).random((12, frames)) > share
    there = np.flatnonzero(seen)
    cov = dense(noise, rest, frames)[np.ix_(there, there)]
    constant = np.kron(np.eye(12), np.ones((frames, 1)))[there]
    inverse = np.linalg.inv(cov)
    left = inverse - inverse @ constant @ np.linalg.solve(constant.T @ inverse @ constant, constant.T @ inverse)
    values = tracks[..., 0].ravel()[there]
    whiten = whitener(noise, rest, seen)
    white = whiten(np.where(seen[..., None], tracks, 7e-3)[..., :1] * [1, 0, 0])
    assert white @ white == pytest.approx(values @ left @ values, rel=1e-4)
    assert whiten.free == 3 * (seen.sum() - 12)


def test_noise_with_gaps_gains_nothing_on_slow_rigid_motions(drawn):
    rest, noise, _, _ = drawn
    rng = np.random.default_rng(4)
    seen = rng.random((50, FRAMES)) > 0.2
    whiten = whitener(noise, rest, seen)
    course = np.linspace(0, 1, FRAMES)[None, :, None]
    columns = whiten(np.stack([np.broadcast_to(course * e, (50, FRAMES, 3)) for e in np.eye(3)])).T
    gains = []
    for _ in range(40):
        b = columns.T @ whiten(np.where(seen[..., None], noise.draw(rest, FRAMES, rng), 0.0))
        gains.append(b @ np.linalg.solve(columns.T @ columns, b))
    assert np.mean(gains) == pytest.approx(3, abs=1.4)


def test_noise_is_found_where_a_fifth_is_missing(drawn):
    rest, noise, tracks, _ = drawn
    seen = np.random.default_rng(6).random((50, FRAMES)) > 0.2
    found = estimate(np.where(seen[..., None], tracks, 0), seen, rest, np.ones(FRAMES, bool), np.full(50, 2e-4))
    assert found.sigma == pytest.approx(noise.sigma, rel=0.15)
    white = whitener(found, rest, seen)
    assert (white(tracks) ** 2).sum() / white.free == pytest.approx(1.0, abs=0.1)


def test_back_is_the_transpose(drawn):
    rest, noise, tracks, seen = drawn
    whiten = whitener(noise, rest, seen)
    other = np.random.default_rng(1).standard_normal(whiten(tracks).shape)
    assert whiten(tracks) @ other == pytest.approx((whiten.back(other) * tracks).sum(), rel=1e-6)


def test_the_metric_is_the_inverse_of_the_whole_covariance():
    rng = np.random.default_rng(2)
    U, a = rng.standard_normal((30, 4)), rng.standard_normal((30, 2))
    wanted = a.T @ np.linalg.solve(np.eye(30) + U @ U.T, a)
    assert np.allclose(metric(U).gram(a, a), wanted, rtol=1e-4, atol=1e-4)
