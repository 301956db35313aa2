"""What a video gets wrong explains itself, and not what tissue does."""

from dataclasses import replace

import numpy as np
import pytest
from planted import GRID, edged, plain, recording

from surgisim.diagnosis import perceived
from surgisim.diagnosis.clip import clip_of
from surgisim.diagnosis.metric import metric
from surgisim.diagnosis.noise import Noise, whitener

QUIET = Noise(np.full(48, 2e-5), 0.0, 0.006, 0.0, 0.0, 0.5, 0.5, 0.0, 0.5, 1.0)
FAR = 4e-3


@pytest.fixture(scope="module")
def made():
    return recording()


@pytest.fixture(scope="module")
def filmed(made):
    """As a video's, and a pull of it that swings once after it is let go."""
    doubt = {"held.depth": 1e-5 * np.ones((*made.visible.shape, 3))}
    clip = clip_of(replace(made, doubts=doubt, astray=0.06), share=GRID)
    time = np.arange(clip.frames)
    course = np.clip((time - 4) / 5, 0, 1) * (time <= 17) - 0.3 * (time == 19) + 0.1 * (time == 20)
    spread = np.exp(-((np.linalg.norm(clip.rest - clip.motion.center_rest[0], axis=1) / 0.012) ** 2))
    pulled = FAR * spread[:, None, None] * course[:, None] * np.array([0.4, 0.2, 0.9])
    return replace(clip, moved=pulled * clip.seen[..., None]), pulled


def noise_of(clip) -> Noise:
    return replace(QUIET, level=np.full(len(clip.rest), 2e-5))


def left(clip, pulled, field) -> float:
    """Chi square of a field that is left beside what a video gets wrong, of some hundreds or more."""
    noise, until = noise_of(clip), clip.until
    whiten = whitener(noise, clip.rest, clip.seen[:, :until])
    groups = [g for g in perceived.groups(clip, pulled, noise) if len(g.columns)]
    columns = np.concatenate([whiten(g.columns[:, :, :until]).T for g in groups], 1)
    z = whiten(field[:, :until])[:, None]
    assert (z**2).sum() > 100
    return float(metric(columns).gram(z, z)[0, 0])


def test_a_body_that_was_measured_has_none_of_it(made):
    clip = clip_of(made, share=GRID)
    noise = noise_of(clip)
    for group in perceived.groups(clip, clip.moved, noise):
        assert group.columns.shape == (0, *clip.moved.shape)


def test_places_that_go_farther_in_proportion_to_the_pull_are_explained_and_what_stays_is_not(filmed):
    clip, pulled = filmed
    wave = np.sin(clip.rest[:, :1] / 0.006)[..., None]
    held = clip.held[None, :, None]
    assert left(clip, pulled, 0.3 * wave * pulled * held) < 150
    time = np.arange(clip.frames)
    back = np.where((time >= 9) & (time <= 17), (13 - time) / 4, 0.0)
    creep = 0.1 * FAR * wave * back[:, None] * np.array([1.0, 0, 0])
    assert left(clip, pulled, creep) > 1000
    stays = 0.3 * wave * pulled[:, 15:16] * (time > 20)[:, None]
    assert left(clip, pulled, stays) > 1000


def test_a_swing_of_another_pace_is_explained(filmed):
    clip, pulled = filmed
    free = (np.arange(clip.frames) > 17)[None, :, None]
    assert left(clip, pulled, np.roll(pulled, 1, axis=1) * free - pulled * free) < 2500


def test_a_track_that_goes_astray_and_one_that_jumps_are_explained_and_tissue_that_steps_is_not(filmed):
    clip, pulled = filmed
    k = int(np.linalg.norm(pulled[:, 15], axis=-1).argsort()[-3])
    alone = np.zeros_like(pulled)
    alone[k] = 0.06 * np.linalg.norm(pulled[k], axis=-1)[:, None] * [1, 0, 0]
    assert left(clip, pulled, alone) < 20
    jump = np.zeros_like(pulled)
    jump[k, 13:] = [1e-3, 0, 0]
    jumped = replace(clip, moved=(pulled + jump) * clip.seen[..., None])
    assert left(jumped, pulled, jump) < 20
    step = 0.25 * FAR * np.exp(-((clip.rest[:, :1] / 0.01) ** 2))[..., None] * (np.arange(clip.frames) >= 13)[:, None]
    step = step * np.array([1.0, 0, 0])
    stepped = replace(clip, moved=(pulled + step) * clip.seen[..., None])
    assert len(perceived.jumps(stepped, noise_of(clip)).columns) == 0


def test_an_edge_that_goes_with_the_pull_is_explained_and_one_that_moves_untouched_is_not(made):
    clip, near = clip_of(edged(made), share=GRID), plain().base.tangent
    group = perceived.edge(clip, near)
    noise, until = noise_of(clip), clip.until
    whiten = whitener(noise, clip.rest, clip.seen[:, :until])
    space = metric(whiten(group.columns[:, :, :until]).T)

    def left(field: np.ndarray) -> float:
        z = whiten(field[:, :until])[:, None]
        return float(space.gram(z, z)[0, 0] / (z**2).sum())

    pulled = np.linalg.norm(clip.motion.position[0] - clip.motion.center_rest[0], axis=1) * clip.held
    # A load near one of the patches, and none of theirs.
    rest = clip.body.rest.astype(float)
    beside = np.exp(-0.5 * (np.linalg.norm(rest - [0.0125, 0.0095, 0.012], axis=1) / 0.004) ** 2) * ~clip.body.held
    loads = near.of_push(beside[None, :, None] * np.eye(3)[:1, None])
    states = near.at_states(np.broadcast_to(loads, (len(near.frames), *loads.shape)))[:, 0]
    with_pull = near.over_time(states, pulled[:until] / pulled.max())
    with_pull *= 1e-3 / np.abs(with_pull).max()
    assert left(with_pull) < 0.1
    wave = near.over_time(states, np.sin(2 * np.pi * np.arange(until) / 6))
    wave *= 1e-3 / np.abs(wave).max()
    assert left(wave) > 0.8
    assert not len(perceived.edge(clip_of(made, share=GRID), near).columns)
