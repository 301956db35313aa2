"""Tracks that are another point's for a while are left out; tissue that steps aside beside a grip is not."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from planted import GRID, plain, recording

from surgisim.artifacts.diagnosis import Diagnosis
from surgisim.artifacts.motion import Motion
from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis import diagnose
from surgisim.diagnosis.clip import clip_of
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.single_track import single_track
from surgisim.diagnosis.strays import strayed
from surgisim.recordings.recording import no_grips

FRAMES, SIGMA, FPS = 60, 2e-4, 25.0


def sheet(seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of a sheet that is pulled along and springs back: where they sit, how they moved, what is seen."""
    rng = np.random.default_rng(seed)
    rest = np.concatenate([rng.uniform(-0.02, 0.02, (80, 2)), np.zeros((80, 1))], 1)
    course = np.interp(np.arange(FRAMES), [10, 20, 40, 41], [0, 1, 1, 0])
    moved = 4e-3 * np.exp(-(rest[:, :1] ** 2) / 0.01**2)[:, None] * course[None, :, None] * np.array([1.0, 0.3, 0.5])
    return rest, moved + SIGMA * rng.standard_normal(moved.shape), rng.uniform(size=moved.shape[:2]) > 0.05


def swapped(rest, moved, frames: slice) -> tuple[np.ndarray, tuple[int, int]]:
    """The same with two points that lie nearest to one another, 2 mm apart or more, taken for one another."""
    apart = np.linalg.norm(rest[:, None] - rest[None], axis=-1) + np.eye(len(rest))
    nearest = apart.argmin(1)
    both = (nearest[nearest] == np.arange(len(rest))) & (apart.min(1) > 2e-3)
    k = int(np.flatnonzero(both)[0])
    j = int(nearest[k])
    moved = moved.copy()
    way = rest[j] - rest[k]
    moved[k, frames], moved[j, frames] = moved[j, frames] + way, moved[k, frames] - way
    return moved, (k, j)


def test_noise_pull_and_release_leave_every_sample():
    for seed in range(5):
        rest, moved, seen = sheet(seed)
        assert strayed(rest, moved, seen, no_grips(FRAMES), FPS).sum() <= 1


@pytest.mark.parametrize("frames", [slice(22, 29), slice(3, 4), slice(12, 48)])
def test_points_that_change_places_are_left_out_for_as_long_as_they_do(frames):
    rest, moved, seen = sheet()
    moved, pair = swapped(rest, moved, frames)
    seen[list(pair)] = True
    gone = strayed(rest, moved, seen, no_grips(FRAMES), FPS)
    wanted = np.zeros(FRAMES, bool)
    wanted[frames] = True
    for k in pair:
        assert (gone[k] == wanted).all()
    assert gone.sum() <= 2 * wanted.sum() + 1


def test_beside_a_grip_only_what_changes_places_has_strayed():
    rest, moved, seen = sheet()
    moved, (k, j) = swapped(rest, moved, slice(22, 29))
    seen[[k, j]] = True
    active = (np.arange(FRAMES) >= 20)[None] & (np.arange(FRAMES) < 35)
    position = np.repeat(rest[[k]][:, None], FRAMES, 1)
    here = Motion(rest[[k]], np.array([5e-3]), position, active, np.ones(1), "given")
    assert strayed(rest, moved, seen, here, FPS)[[k, j]].sum() == 14
    alone = moved.copy()
    alone[j] = sheet()[1][j]
    assert not strayed(rest, alone, seen, here, FPS)[[k, j]].any()
    assert strayed(rest, alone, seen, no_grips(FRAMES), FPS)[k].sum() == 7
    # Before anything grips, nothing but a tracker steps aside; half a second after it has let go neither.
    for frames in (slice(12, 29), slice(25, 55)):
        moved, (k, j) = swapped(*sheet()[:2], frames)
        moved[j] = sheet()[1][j]
        assert strayed(rest, moved, seen, here, FPS)[k].sum() == frames.stop - frames.start


def test_few_points_are_not_judged():
    rest, moved, seen = sheet()
    moved, pair = swapped(rest, moved, slice(22, 29))
    few = [*pair, *(k for k in range(5) if k not in pair)][:5]
    assert not strayed(rest[few], moved[few], seen[few], no_grips(FRAMES), FPS).any()


def test_a_diagnosis_leaves_them_out_of_what_was_measured_and_not_of_a_video():
    made = recording()
    moved, (k, j) = swapped(made.place, made.points - made.place[:, None], slice(6, 12))
    other = replace(made, points=(moved + made.place[:, None]).astype(np.float32))
    plain, clip = clip_of(made, share=GRID), clip_of(other, share=GRID)
    mine = np.isin(clip.kept, (k, j))
    assert clip.strayed == (plain.seen & ~clip.seen).sum() > 0
    assert not clip.seen[mine][:, 6:12].any()
    assert not clip.moved[~clip.seen].any()
    assert clip_of(replace(other, astray=0.05), share=GRID).strayed == 0


@pytest.mark.parametrize(("spread", "alone"), [(0.0, True), (3e-3, False)])
def test_a_law_that_one_track_alone_asks_for_is_that_track_s(spread, alone):
    case, k = plain(), 7
    away = np.linalg.norm(case.clip.rest - case.clip.rest[k], axis=1)
    share = np.exp(-0.5 * (away / max(spread, 1e-6)) ** 2)
    response = 1e-3 * share[:, None, None] * case.clip.held[None, :, None] * np.array([1.0, 0.0, 0.0])
    moved = (case.clip.moved + response) * case.clip.seen[..., None]
    other = replace(case, clip=replace(case.clip, moved=moved))
    refit = SimpleNamespace(response=response)
    assert single_track(other, refit) == (k if alone else None)
    # What helps nobody is nobody's.
    assert single_track(case, refit) is None
    video = replace(other.clip, recording=replace(other.clip.recording, astray=0.05))
    assert single_track(replace(other, clip=video), refit) is None


def test_without_that_track_it_is_diagnosed_again_and_said(monkeypatch, tmp_path):
    seen = []

    def again(recording, settings, progress, memo, single):
        seen.append((recording.visible.any(1), single, memo))
        base = {"E": {"value": 1.0}}
        found = Diagnosis(
            "r", "nothing detectable", [], [], {}, [], {}, {}, 0.0, "Nothing.", base, {"left_out": [3]}, {}
        )
        return found, None, None

    monkeypatch.setattr(diagnose, "diagnose", again)
    made, runs = recording(), Memo(tmp_path, "a recording")
    runs("tracks", lambda: {"seen": np.zeros((len(made.points), 3))})
    found, *_ = diagnose.without_track(made, 9, "hidden_contact", Diagnosing(), lambda *_: None, runs, 2)
    assert (np.flatnonzero(~seen[0][0]).tolist(), seen[0][1]) == ([9], 2)
    # Tracks that were kept are of all points.
    fewer = np.zeros((len(made.points) - 1, 3))
    assert seen[0][2]("tracks", lambda: {"seen": fewer})["seen"].shape == fewer.shape
    assert found.noise["left_out"] == [9, 3]
    assert found.words == "Nothing. Point 9 was left out: its track alone asked for hidden contact."
