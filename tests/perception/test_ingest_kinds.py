"""What kinds of recording are read, and what becomes of their numbers."""

import numpy as np
import pytest
from recordings import H, W, endonerf, operated, pictures, png, silent, tissue, video, zipped

from surgisim.artifacts.frames import AFTER, BETWEEN, USED
from surgisim.config.ingest import Ingest
from surgisim.perception.ingest.clip import ingest
from surgisim.perception.ingest.clock import is_still


def read(path, **settings):
    return ingest(path, Ingest(**settings), progress=silent)


@pytest.mark.parametrize("suffix", [".mp4", ".avi", ".mkv"])
def test_a_video_comes_back_frame_by_frame(tmp_path, suffix):
    frames, _ = operated()
    read_frames, camera, given = read(video(tmp_path / f"clip{suffix}", frames, fps=20))
    assert read_frames.rgb.shape == frames.shape
    assert np.abs(read_frames.rgb.astype(int) - frames).mean() < 8
    assert camera.fps == pytest.approx(20)
    assert (camera.focal_from, camera.fx, camera.scale) == ("assumed", pytest.approx(0.9 * W), "arbitrary")
    assert len(given.tool) == len(given.depth) == len(given.right) == 0


def test_images_are_read_in_the_order_a_person_would_count(tmp_path):
    frames = np.stack([tissue(t) for t in range(12)])
    assert np.array_equal(read(pictures(tmp_path / "clip", frames))[0].rgb, frames)


def test_an_endonerf_folder_brings_masks_depth_right_view_and_focal(tmp_path):
    folder, frames, tool = endonerf(tmp_path / "pulling")
    read_frames, camera, given = read(folder)
    assert np.array_equal(read_frames.rgb, frames)
    assert np.array_equal(given.tool, tool)
    assert given.depth[0, 0, 0] == pytest.approx(0.040)
    assert given.right.shape == frames.shape
    assert (camera.focal_from, camera.scale, camera.fx) == ("given", "known", pytest.approx(75.0))


def test_an_endonerf_zip_and_a_folder_of_zips_say_the_same_as_the_folder(tmp_path):
    folder, frames, tool = endonerf(tmp_path / "pulling")
    files = {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}
    one = zipped(tmp_path / "all.zip", {f"pulling/{name}": data for name, data in files.items()})
    (tmp_path / "parts").mkdir()
    zipped(tmp_path / "parts/images.zip", {n: d for n, d in files.items() if n.startswith("images/")})
    zipped(tmp_path / "parts/rest.zip", {n: d for n, d in files.items() if not n.startswith("images/")})
    for path in (one, tmp_path / "parts"):
        read_frames, camera, given = read(path)
        assert np.array_equal(read_frames.rgb, frames)
        assert np.array_equal(given.tool, tool)
        assert camera.fx == pytest.approx(75.0)


def test_the_plain_masks_are_taken_when_asked_for_and_white_may_mean_tissue(tmp_path):
    folder, _, tool = endonerf(tmp_path / "pulling")
    assert read(folder, given_masks="masks")[2].tool.shape == tool.shape
    assert np.array_equal(read(folder, masks_show="tissue")[2].tool, ~tool)
    assert len(read(folder, given_masks="none")[2].tool) == 0


def test_a_hole_in_the_depth_is_closed_only_from_beside_it(tmp_path):
    folder, _, _ = endonerf(tmp_path / "pulling")
    depth = np.full((H, W), 50, np.uint8)
    depth[20:40, 20:40] = 0
    pictures(folder / "depth", np.stack([depth] * 9))
    small = read(folder, size=40)[2].depth[0]
    assert small[15, 15] == 0
    assert (small > 0).mean() > 0.85
    assert np.unique(small).tolist() == pytest.approx([0, 0.05])


def test_the_camera_follows_crop_and_size(tmp_path):
    """A point seen at a source pixel is seen at the corresponding working pixel."""
    folder = pictures(tmp_path / "clip", np.stack([tissue(t) for t in range(4)]))
    camera = read(folder, crop=(10, 4, 60, 48), size=40, focal=70.0)[1]
    point = np.array([0.01, -0.005, 0.05])
    source = 70.0 * point[:2] / point[2] + np.array([(W - 1) / 2, (H - 1) / 2])
    expected = (source - [10, 4] + 0.5) * [camera.width / 60, camera.height / 48] - 0.5
    assert camera.project(point) == pytest.approx(expected)
    assert (camera.width, camera.height, camera.crop) == (40, 32, [10, 4, 60, 48])


def test_black_borders_are_cut_off_alike_in_all_frames(tmp_path):
    frames, _ = operated()
    boxed = np.zeros((len(frames), H + 20, W + 12, 3), np.uint8)
    boxed[:, 8 : 8 + H, 6 : 6 + W] = frames
    read_frames, camera, _ = read(pictures(tmp_path / "clip", boxed))
    assert camera.crop == [6, 8, W, H]
    assert np.array_equal(read_frames.rgb, frames)


def test_an_endoscope_circle_keeps_all_that_is_lit(tmp_path):
    y, x = np.mgrid[:90, :120]
    circle = (x - 60) ** 2 + (y - 45) ** 2 < 40**2
    frames = np.stack([tissue(t, (90, 120)) * circle[..., None] for t in range(5)]).astype(np.uint8)
    left, top, width, height = read(pictures(tmp_path / "clip", frames))[1].crop
    assert (left, top) == (pytest.approx(20, abs=3), pytest.approx(5, abs=3))
    assert (width, height) == (pytest.approx(80, abs=5), pytest.approx(80, abs=5))


def test_a_dark_scene_is_not_taken_for_a_border(tmp_path):
    frames = np.zeros((4, H, W, 3), np.uint8)
    frames[:, 20:30, 30:40] = tissue(0)[20:30, 30:40]
    assert read(pictures(tmp_path / "clip", frames))[1].crop == [0, 0, W, H]


@pytest.mark.parametrize("size", [(65, 81), (64, 81), (33, 47)])
def test_odd_sizes_are_as_good_as_even_ones(tmp_path, size):
    frames = np.stack([tissue(t, size) for t in range(4)])
    read_frames, camera, _ = read(pictures(tmp_path / "clip", frames))
    assert read_frames.rgb.shape[1:3] == size == (camera.height, camera.width)


def test_a_frame_shown_twice_is_kept_once_and_the_clock_slows(tmp_path):
    frames, _ = operated(16, shift=2.0)
    path = video(tmp_path / "clip.mp4", frames.repeat(2, axis=0), fps=60)
    read_frames, camera, _ = read(path)
    assert camera.frames == 16
    assert camera.fps == pytest.approx(30)
    assert np.abs(read_frames.rgb.astype(int) - frames).mean() < 8
    assert read(path, drop_duplicates=False)[1].frames == 32


def test_tissue_that_rests_for_a_while_loses_no_frames(tmp_path):
    frames, _ = operated(14, shift=2.0)
    resting = np.concatenate([frames[:7], frames[6:7].repeat(8, axis=0), frames[7:]])
    assert read(pictures(tmp_path / "clip", resting))[1].frames == len(resting)


def test_start_end_and_most_frames_choose_a_part(tmp_path):
    frames = np.stack([tissue(t) for t in range(20)])
    path = pictures(tmp_path / "clip", frames)
    assert np.array_equal(read(path, fps=10, start=0.5, end=1.2)[0].rgb, frames[5:12])
    assert np.array_equal(read(path, max_frames=6)[0].rgb, frames[:6])


def test_every_eighth_frame_and_the_tail_are_held_out(tmp_path):
    split = read(pictures(tmp_path / "clip", np.stack([tissue(t) for t in range(40)])))[0].split
    assert np.flatnonzero(split == BETWEEN).tolist() == [1, 9, 17, 25, 33]
    assert np.flatnonzero(split == AFTER).tolist() == list(range(34, 40))


@pytest.mark.parametrize("count", range(2, 9))
def test_short_clips_keep_two_frames_to_learn_from(tmp_path, count):
    split = read(pictures(tmp_path / "clip", np.stack([tissue(t) for t in range(count)])))[0].split
    assert (split == USED).sum() >= 2
    assert split[0] == USED


def test_a_still_video_is_read_and_known_to_be_still(tmp_path):
    still = np.stack([tissue(0)] * 6)
    assert is_still(read(pictures(tmp_path / "clip", still))[0].rgb)
    assert not is_still(operated()[0])


def test_reading_twice_gives_the_same_bytes(tmp_path):
    path = video(tmp_path / "clip.mp4", operated()[0])
    first, second = (read(path, size=48) for _ in range(2))
    for a, b in zip(first, second, strict=True):
        assert a.encode({}) == b.encode({})


def test_the_pulling_clip_is_read_from_its_three_zips(shared):
    frames, camera, given = read(shared / "data/endonerf_pulling", max_frames=4)
    assert frames.rgb.shape == (4, 256, 320, 3)
    assert given.tool.shape == given.depth.shape == (4, 256, 320)
    assert camera.fx == pytest.approx(569.468 / 2, rel=1e-4)
    assert 0.2 < given.tool.mean() < 0.4
    assert 0.03 < np.median(given.depth[given.depth > 0]) < 0.11


def test_a_hidden_file_among_the_images_is_passed_over(tmp_path):
    folder = pictures(tmp_path / "clip", np.stack([tissue(t) for t in range(3)]))
    (folder / "._frame0.png").write_bytes(b"junk")
    (folder / "frame1.png").write_bytes(png(tissue(1)))
    assert read(folder)[1].frames == 3
