"""Metrics of pictures: known answers, and that the instrument counts for nothing."""

import cv2
import numpy as np
import pytest

from surgisim.measure.lpips import load_lpips
from surgisim.measure.overlap import overlap
from surgisim.measure.psnr import psnr
from surgisim.measure.slices import liveliest_column, slice_yt
from surgisim.measure.ssim import ssim
from surgisim.problem import Problem

rng = np.random.default_rng(0)
PICTURE = cv2.GaussianBlur(rng.integers(0, 256, (64, 80, 3)).astype(np.uint8), (0, 0), 1.5)
ALL = np.ones(PICTURE.shape[:2], bool)
HALF = np.broadcast_to(np.arange(80) < 40, (64, 80))


@pytest.fixture(scope="session")
def lpips(shared):
    return load_lpips(shared / "weights" / "lpips_alex.safetensors")


def test_ten_grey_levels_off_is_28_decibels():
    dim = np.full((4, 4, 3), 100, np.uint8)
    assert psnr(dim + 10, dim, ALL[:4, :4]) == pytest.approx(20 * np.log10(25.5))


def test_equal_pictures_have_no_noise_and_full_similarity():
    assert psnr(PICTURE, PICTURE, ALL) == np.inf
    assert ssim(PICTURE, PICTURE, ALL) == pytest.approx(1)


def test_what_lies_outside_the_mask_counts_for_nothing():
    spoilt = np.where(HALF[..., None], PICTURE, 255 - PICTURE)
    other = np.where(HALF[..., None], PICTURE, 7).astype(np.uint8)
    noisy = (PICTURE // 2).astype(np.uint8)
    for metric in (psnr, ssim):
        assert metric(spoilt, noisy, HALF) == metric(other, noisy, HALF)
    assert ssim(spoilt, PICTURE, HALF) == pytest.approx(1)


def test_without_a_pixel_there_is_no_number():
    assert np.isnan(psnr(PICTURE, PICTURE, ~ALL))
    assert np.isnan(ssim(PICTURE, PICTURE, ~ALL))
    assert np.isnan(overlap(~ALL, ~ALL))


def test_two_thirds_shared_overlap_by_a_half():
    a, b = np.zeros((1, 4), bool), np.zeros((1, 4), bool)
    a[0, :3], b[0, 1:] = True, True
    assert overlap(a, b) == 0.5


@pytest.mark.shared
def test_lpips_is_nothing_for_equal_pictures_and_grows_with_blur(lpips):
    blurred = [cv2.GaussianBlur(PICTURE, (0, 0), s) for s in (1, 2, 4)]
    apart = [lpips(b, PICTURE, ALL) for b in blurred]
    assert lpips(PICTURE, PICTURE, ALL) == 0
    assert 0 < apart[0] < apart[1] < apart[2]


@pytest.mark.shared
def test_lpips_does_not_see_the_instrument(lpips):
    spoilt = np.where(HALF[..., None], PICTURE, 255 - PICTURE)
    assert lpips(spoilt, PICTURE, HALF) == 0


def test_weights_of_something_else_are_refused(tmp_path):
    from safetensors.numpy import save_file

    save_file({"features.0.weight": np.zeros(3, np.float32)}, tmp_path / "w.safetensors")
    with pytest.raises(Problem, match="lacks"):
        load_lpips(tmp_path / "w.safetensors")
    (tmp_path / "x.safetensors").write_bytes(b"nothing")
    with pytest.raises(Problem, match="cannot be read"):
        load_lpips(tmp_path / "x.safetensors")


def test_a_slice_shows_one_column_over_time():
    film = rng.integers(0, 256, (5, 6, 7, 3)).astype(np.uint8)
    assert np.array_equal(slice_yt(film, 3)[:, 2], film[2, :, 3])


def test_the_liveliest_column_is_where_the_tissue_changes_and_not_the_tool():
    film, tissue = np.zeros((4, 6, 7, 3), np.uint8), np.ones((4, 6, 7), bool)
    film[::2, :, 2], film[::2, :, 5] = 100, 200
    tissue[..., 5] = False
    assert liveliest_column(film, tissue) == 2
