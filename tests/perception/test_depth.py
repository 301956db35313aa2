import cv2
import numpy as np
import pytest
from pulled_sheet import camera, pull_sheet

from surgisim.artifacts.correspondence import Correspondence
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.artifacts.inpainted import COPIED, SEEN, Inpainted
from surgisim.artifacts.masks import Masks
from surgisim.config.depth import Depth as Settings
from surgisim.lighting.headlight import to_srgb
from surgisim.perception.depth import near_light, shading, stereo
from surgisim.perception.depth.complete import complete
from surgisim.perception.depth.distance import depth as of_frames
from surgisim.perception.depth.guided import guided
from surgisim.perception.tracking.between import sample
from surgisim.perception.tracking.correspond import between
from surgisim.problem import Problem

NONE = np.zeros((0, 48, 64), np.float32)


def test_a_plane_that_faces_the_lamp_is_as_bright_as_cos_over_distance_squared():
    cam = camera(64, 48, 1)
    lattice = shading.Lattice.of(cam, 1.0)
    away = np.sqrt((lattice.ray**2).sum(-1) + 1)
    dark = shading.shading(lattice, np.full(lattice.shape, np.log(0.07)))
    assert np.allclose(np.exp(-dark), (1 / away) / (0.07 * away) ** 2)


def test_the_shading_of_a_tilted_plane_is_that_of_its_normal():
    cam = camera(64, 48, 1)
    lattice = shading.Lattice.of(cam, 1.0)
    normal = np.array([0.3, -0.2, 1.0]) / np.linalg.norm([0.3, -0.2, 1.0])
    ray = np.concatenate([lattice.ray, np.ones((*lattice.shape, 1))], -1)
    z = 0.07 / (ray @ normal)
    away = np.linalg.norm(ray * z[..., None], axis=-1)
    bright = (ray @ normal) / np.linalg.norm(ray, axis=-1) / away**2
    inner = (slice(2, -2), slice(2, -2))
    assert np.allclose(shading.shading(lattice, np.log(z))[inner], -np.log(bright)[inner], atol=2e-3)


def test_the_depth_that_explains_a_shading_is_the_one_that_made_it():
    lattice = shading.Lattice.of(camera(40, 32, 1), 1.0)
    x, y = lattice.ray[..., 0], lattice.ray[..., 1]
    true = 0.1 * x - 0.2 * y - 0.05 * np.exp(-(x**2 + y**2) / 0.04)
    light = -shading.shading(lattice, true)
    found, rest = shading.explain(
        lattice, light, np.ones_like(light), 0 * light, spread_of_data=0.01, spread_of_shape=1.0, finest=0.1
    )
    assert np.abs(found - true).max() < 0.01
    assert np.abs(rest).max() < 0.02


def test_a_tilted_sheet_of_any_paint_is_found_tilted():
    sheet = pull_sheet(frames=2)
    z, _ = _near_light(sheet.rgb, sheet.tool, sheet.camera)
    slope = np.polyfit(sheet.depth[0].ravel(), z[0].ravel() * 0.07 / np.median(z[0]), 1)[0]
    assert np.corrcoef(z[0].ravel(), sheet.depth[0].ravel())[0, 1] > 0.8
    assert 0.4 < slope < 1.3


@pytest.mark.parametrize("smoke", [0.0, 0.2])
def test_a_slanted_view_is_found_as_slanted_as_it_is(smoke):
    cam = camera(96, 72, 1)
    lattice = shading.Lattice.of(cam, 1.0)
    true = 0.1 * lattice.ray[..., 0] - 0.6 * lattice.ray[..., 1]
    paint = 1 + 0.1 * np.random.default_rng(0).standard_normal(lattice.shape)
    light = 0.3 * paint * np.exp(-shading.shading(lattice, true))
    seen = (1 - smoke) * np.clip(light[..., None] * [1.0, 0.6, 0.5], 0, 1) + 0.35 * smoke
    rgb = np.rint(255 * to_srgb(seen)).astype(np.uint8)[None]
    none = np.zeros(rgb.shape[:3], bool)
    z, _ = _near_light(rgb, none, cam)
    flat = np.concatenate([lattice.ray.reshape(-1, 2), np.ones((true.size, 1))], -1)
    slope = np.linalg.lstsq(flat, np.log(z[0]).ravel(), rcond=None)[0][:2]
    assert np.allclose(slope, [0.1, -0.6], atol=0.08)


def test_a_lamp_that_falls_off_to_the_corners_bends_a_plane_little():
    cam = camera(96, 72, 1)
    lattice = shading.Lattice.of(cam, 1.0)
    falls = (lattice.ray**2).sum(-1)
    paint = 1 + 0.1 * np.random.default_rng(0).standard_normal(lattice.shape)
    light = 0.4 * paint * np.exp(-shading.shading(lattice, 0 * falls) - 0.6 * falls / falls.max())
    rgb = np.rint(255 * to_srgb(np.clip(light[..., None] * [1.0, 0.6, 0.5], 0, 1))).astype(np.uint8)[None]
    z, _ = _near_light(rgb, np.zeros(rgb.shape[:3], bool), cam)
    # Were the lamp's fall-off depth, corners would be .3 farther in its logarithm.
    assert np.ptp(np.log(z[0])) < 0.1


@pytest.mark.parametrize("pull", [(0.006, -0.004, -0.004), (-0.006, -0.004, 0.0)])
def test_tissue_that_comes_nearer_is_told_from_tissue_that_only_slides(pull):
    sheet = pull_sheet(pull=pull, frames=14, begin=2, release=9)
    z, _ = _near_light(sheet.rgb, sheet.tool, sheet.camera)
    moved = np.linalg.norm(sheet.xyz[8] - sheet.xyz[0], axis=-1) > 1e-3
    change = (sample(z[8], sheet.position[8]) - z[0])[moved]
    true = (sheet.xyz[8] - sheet.xyz[0])[..., 2][moved]
    # The sheet does not bend as tissue does: a soft layer takes its surroundings along farther (test_pull.py).
    assert np.sqrt(((change - true) ** 2).mean()) < 0.0011
    back = (sample(z[-1], sheet.position[-1]) - z[0])[moved]
    assert np.abs(back).mean() < 0.0004


def test_a_loop_that_tracking_loses_comes_nearer_as_it_grows_brighter():
    count, nearer = 6, 0.7
    cam = camera(128, 96, count)
    y, x = np.indices((96, 128))
    loop = np.hypot(x - 70, y - 45) < 18
    light = np.exp(-shading.shading(shading.Lattice.of(cam, 1.0), np.zeros((96, 128))))
    paint = 1 + 0.05 * np.random.default_rng(0).standard_normal(light.shape)
    rgb, moved = np.empty((count, 96, 128, 3), np.uint8), np.zeros((count, 96, 128, 2), np.float16)
    seen = np.ones((count, 96, 128), bool)
    for t, share in enumerate(np.linspace(0, 1, count)):
        linear = 0.25 * paint * light * np.where(loop, nearer ** (-2 * share), 1.0)
        rgb[t] = np.rint(255 * to_srgb(np.clip(linear[..., None] * [1.0, 0.6, 0.5], 0, 1)))
        # Stripes that go to and fro are no pulled layer.
        moved[t, ..., 1] = 4 * share * np.sin(0.2 * x)
        seen[t] = ~loop | (t == 0)
    surface = Correspondence(moved, seen, np.zeros(seen.shape, np.float16), np.zeros(seen.shape, bool))
    none = np.zeros(seen.shape, bool)
    z, confidence = near_light.estimate(rgb, none, none, cam, surface)
    change = np.log(z[-1] / z[0])
    assert np.median(change[loop]) == pytest.approx(np.log(nearer), rel=0.35)
    assert np.abs(np.median(change[~cv2.dilate(loop.astype(np.uint8), np.ones((9, 9))).astype(bool)])) < 0.03
    assert confidence[-1][loop].mean() < 0.5 * confidence[-1][~loop].mean()


def test_holes_and_frames_without_any_depth_are_bridged():
    z = np.full((5, 48, 64), 0.06, np.float32)
    z += np.linspace(0, 0.01, 64, dtype=np.float32) + 0.001 * np.arange(5)[:, None, None].astype(np.float32)
    true, known = z.copy(), np.ones(z.shape, bool)
    known[2] = False
    known[:, 20:26, 30:40] = False
    whole, trust = complete(np.where(known, z, 0.0), known, np.ones(z.shape, bool))
    assert np.abs(whole - true).max() < 0.0015
    assert trust[1, 10, 10] > trust[2, 10, 10] > 0
    assert trust[1, 22, 35] < 0.5 * trust[1, 10, 10]


def test_given_depth_keeps_its_scale_through_millimetre_steps():
    true = 0.05 + 0.01 * np.linspace(0, 1, 64, dtype=np.float32) * np.ones((5, 48, 1), np.float32)
    given = Given(np.zeros((0, 48, 64), bool), np.round(true, 3), np.zeros((0, 48, 64, 3), np.uint8), 0.0)
    result = depth(*_clip(5), given, camera(64, 48, 5), Settings())
    assert result.scale == "known"
    assert np.sqrt(((result.z - true) ** 2).mean()) < 0.00025


@pytest.mark.parametrize(("baseline", "scale"), [(0.004, "known"), (0.0, "arbitrary")])
def test_a_right_view_gives_depth_and_a_baseline_its_scale(baseline, scale):
    cam = camera(64, 48, 2)
    rng = np.random.default_rng(1)
    left = np.repeat(rng.integers(0, 255, (1, 48, 64, 3), dtype=np.uint8), 2, 0)
    right = np.roll(left, -6, axis=2)
    masks, inpainted = _clip(2)[1], Inpainted(left, np.zeros(left.shape[:3], np.uint8))
    given = Given(np.zeros((0, 48, 64), bool), NONE, right, baseline)
    result = depth(inpainted, masks, given, cam, Settings(distance=0.09))
    assert result.scale == scale
    want = cam.fx * baseline / 6 if baseline else 0.09
    assert np.allclose(np.median(result.z), want, rtol=0.01)


def test_a_right_view_is_matched_below_the_pixel_and_only_where_it_reaches(monkeypatch):
    rng = np.random.default_rng(2)
    paint = cv2.GaussianBlur(rng.uniform(0, 255, (64, 140, 3)), (0, 0), 1.2)
    paint = 128 + 4 * (paint - 128)
    y, x = np.indices((64, 96), np.float32)
    left, right = (
        np.clip(cv2.remap(paint, x + 20 + shift, y, cv2.INTER_CUBIC), 0, 255).astype(np.uint8) for shift in (0.0, 7.3)
    )
    found = stereo.match(left, right)
    whole = found[8:-8, 16:-8]
    refined = stereo.registered(left, right, found, found > 0.5)[8:-8, 16:-8]
    assert np.abs(refined - 7.3).mean() < 0.03
    assert np.abs(refined - 7.3).mean() < 0.5 * np.abs(whole - 7.3).mean()
    cam = camera(96, 64, 2)
    given = Given(np.zeros((0, 64, 96), bool), NONE.reshape(0, 64, 96), np.stack([right] * 2), 0.004)
    guide = np.full((2, 64, 96), 0.07), np.full((2, 64, 96), 0.3)
    hidden = np.zeros((2, 64, 96), bool)
    z, trust, _ = stereo.estimate(np.stack([left] * 2), hidden, given, cam, guide, distance=0.07)
    assert z[0][:, 20:80] == pytest.approx(cam.fx * 0.004 / 7.3, rel=0.02)
    assert trust[:, 10:-10, 1:5].mean() < 0.5 * trust[:, 10:-10, 20:80].mean()
    # What fits best far from where it was matched is not measured.
    astray = 1.8 * ((x > 40) & (x < 52))
    registered = stereo.registered
    monkeypatch.setattr(stereo, "registered", lambda *views: registered(*views) + astray)
    z, trust, _ = stereo.estimate(np.stack([left] * 2), hidden, given, cam, guide, distance=0.07)
    assert z[0][:, 20:80] == pytest.approx(cam.fx * 0.004 / 7.3, rel=0.02)
    assert trust[:, 10:-10, 44:48].mean() < 0.8 * trust[:, 10:-10, 20:36].mean()


def test_noise_is_averaged_along_the_guides_shape_and_neither_its_scale_nor_a_step_it_lacks_is_lost():
    rng = np.random.default_rng(3)
    y, x = np.indices((64, 96))
    guide = np.stack([1.0 + 0.1 * np.exp(-((x - 60) ** 2 + (y - 32) ** 2) / 72) * t / 5 for t in range(6)])
    true = 0.06 * guide * np.where(x < 20, 0.7, 1.0)
    measured = true * np.exp(rng.normal(0, 0.01, true.shape))
    known = rng.random(true.shape) < 0.8
    specks = rng.random(true.shape) < 0.005
    z, share = guided(guide, np.where(specks, 1.6 * measured, measured), known)
    wrong = np.abs(np.log(z / true))
    assert np.median(wrong) < 0.002
    assert np.percentile(wrong[:, :, :14], 99) < 0.015
    assert np.percentile(wrong[:, :, 26:], 99) < 0.015
    assert share.min() > 0.5
    known[3] = False
    z, share = guided(guide, measured, known)
    assert np.median(np.abs(np.log(z[3] / true[3]))) < 0.005
    assert share[3].max() < 0.1


def test_what_was_not_seen_is_hardly_trusted():
    inpainted, masks = _clip(5)
    origin = np.where(np.arange(64) < 20, COPIED, SEEN) * np.ones((5, 48, 1), int)
    given = Given(np.zeros((0, 48, 64), bool), NONE, np.zeros((0, 48, 64, 3), np.uint8), 0.0)
    result = depth(Inpainted(inpainted.rgb, origin.astype(np.uint8)), masks, given, camera(64, 48, 5), Settings())
    assert result.confidence[:, :, :20].max() <= 0.1 < result.confidence[:, :, 25:].mean()


def test_a_black_recording_still_has_a_depth():
    masks = _clip(3)[1]
    black = Inpainted(np.zeros((3, 48, 64, 3), np.uint8), np.zeros((3, 48, 64), np.uint8))
    given = Given(np.zeros((0, 48, 64), bool), NONE, np.zeros((0, 48, 64, 3), np.uint8), 0.0)
    assert np.allclose(depth(black, masks, given, camera(64, 48, 3), Settings()).z, 0.07)


@pytest.mark.parametrize(("backend", "word"), [("given", "given"), ("stereo", "right"), ("depth_anything", "weights")])
def test_a_backend_without_its_input_says_what_it_wants(backend, word):
    given = Given(np.zeros((0, 48, 64), bool), NONE, np.zeros((0, 48, 64, 3), np.uint8), 0.0)
    with pytest.raises(Problem, match=word) as problem:
        depth(*_clip(2), given, camera(64, 48, 2), Settings(backend=backend))
    assert "near_light" in str(problem.value)


def depth(inpainted, masks, given, cam, settings):
    """Of a recording from which nothing had to be taken away."""
    frames = Frames(inpainted.rgb, np.zeros(len(inpainted.rgb), np.uint8))
    surface = between(inpainted.rgb, masks.tool)
    return of_frames(frames, inpainted, masks, surface, given, cam, settings)


def _near_light(rgb, tool, cam):
    return near_light.estimate(rgb, tool, np.zeros_like(tool), cam, between(rgb, tool))


def _clip(frames: int) -> tuple[Inpainted, Masks]:
    sheet = pull_sheet(frames=frames, size=(64, 48))
    none = np.zeros_like(sheet.tool)
    masks = Masks(none, ~none, none, np.ones(frames, np.float32))
    return Inpainted(sheet.rgb, np.zeros(none.shape, np.uint8)), masks


def test_a_frame_in_which_nothing_is_recognised_keeps_the_distance():
    inpainted, masks = _clip(4)
    tool = np.zeros_like(masks.tool)
    tool[2:] = True
    masks = Masks(tool, ~tool, np.zeros_like(tool), np.ones(4, np.float32))
    given = Given(np.zeros((0, 48, 64), bool), NONE, np.zeros((0, 48, 64, 3), np.uint8), 0.0)
    result = depth(inpainted, masks, given, camera(64, 48, 4), Settings())
    assert np.abs(np.log(result.z / 0.07)).max() < 0.4
