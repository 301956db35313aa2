"""What the instrument hides is taken from frames that saw it, and only what none saw is invented."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from onnx_file import write
from recordings import H, W, operated, silent, tissue

from surgisim.artifacts.frames import Frames
from surgisim.artifacts.inpainted import COPIED, INVENTED, SEEN
from surgisim.artifacts.masks import Masks
from surgisim.config.inpainting import Inpainting
from surgisim.perception.inpainting.removal import without_tool
from surgisim.perception.inpainting.smooth import continued
from surgisim.problem import Problem

SIZE = (96, 120)


def filled(rgb, tool, **settings):
    masks = Masks(tool, ~tool, np.zeros_like(tool), np.ones(len(tool), "f4"))
    frames = Frames(rgb, np.zeros(len(rgb), np.uint8))
    return without_tool(frames, masks, Inpainting(**settings), progress=silent)


def passing(count=16):
    """A sheet that drifts right, an upright bar that crosses it, and the sheet without the bar."""
    sheet = cv2.GaussianBlur(tissue(1, (SIZE[0], SIZE[1] + 60)), (0, 0), 1.0)
    drift = [np.float32([[1, 0, 0.6 * t - 30], [0, 1, 0]]) for t in range(count)]
    clean = np.stack([cv2.warpAffine(sheet, d, SIZE[::-1], flags=cv2.INTER_CUBIC) for d in drift])
    tool = np.zeros(clean.shape[:3], bool)
    for t in range(count):
        tool[t, :70, 20 + 4 * t : 32 + 4 * t] = True
    rgb = clean.copy()
    rgb[tool] = (150, 152, 156)
    return rgb, tool, clean


def test_without_an_instrument_frames_are_unchanged():
    rgb, tool, _ = passing()
    result = filled(rgb, tool & False)
    assert np.array_equal(result.rgb, rgb)
    assert (result.origin == SEEN).all()


def test_pixels_outside_the_hole_are_the_recordings_own():
    rgb, tool, _ = passing()
    result = filled(rgb, tool, margin=2)
    assert np.array_equal(result.rgb[result.origin == SEEN], rgb[result.origin == SEEN])
    assert (result.origin[tool] != SEEN).all()


def test_tissue_hidden_for_a_while_comes_back_as_it_was():
    rgb, tool, clean = passing()
    result = filled(rgb, tool)
    copied = result.origin == COPIED
    assert copied[tool].mean() > 0.95
    wrong = np.abs(result.rgb.astype(int) - clean)[copied].mean()
    unmoved = np.abs(np.roll(clean, 4, 0).astype(int) - clean)[copied].mean()
    assert wrong < 1.4 < unmoved


def test_a_change_of_light_between_frames_does_not_show():
    rgb, tool, clean = passing()
    gain = np.linspace(0.8, 1.1, len(rgb))[:, None, None, None]
    lit = [np.clip(a * gain, 0, 255).astype(np.uint8) for a in (rgb, clean)]
    result = filled(lit[0], tool)
    copied = result.origin == COPIED
    assert np.abs(result.rgb.astype(int) - lit[1])[copied].mean() < 4


def test_what_no_frame_saw_is_invented_in_the_colours_around_it():
    rgb, tool = operated(8, SIZE, shift=0.0)
    result = filled(rgb, tool)
    invented = result.origin == INVENTED
    assert invented.sum() > 0.5 * tool.sum()
    around = rgb[~tool].astype(float)
    off = np.abs(result.rgb[invented].mean(0) - around.mean(0))
    assert (off < 15).all()


def test_what_is_invented_does_not_flicker():
    rgb = operated(1, SIZE)[0].repeat(8, 0)
    tool = operated(1, SIZE)[1].repeat(8, 0)
    noise = np.random.default_rng(0).integers(-3, 4, rgb.shape)
    result = filled(np.clip(rgb.astype(int) + noise, 0, 255).astype(np.uint8), tool)
    invented = (result.origin == INVENTED).all(0)
    assert np.abs(np.diff(result.rgb[:, invented].astype(int), axis=0)).mean() < 1


def test_a_copy_is_the_mean_of_what_was_seen_before_and_after():
    """Noise of its own in every frame: two frames that are as far away halve its variance, and so does reading each
    between pixels."""
    sheet = cv2.GaussianBlur(tissue(1, SIZE), (0, 0), 2.0).astype(float)
    noise = np.random.default_rng(0).normal(0, 6, (5, *sheet.shape))
    rgb = np.clip(sheet + noise, 0, 255).astype(np.uint8)
    tool = np.zeros(rgb.shape[:3], bool)
    tool[2, 30:60, 40:70] = True
    off = (filled(rgb, tool, margin=0).rgb[2].astype(float) - sheet)[tool[2]]
    alone = (rgb[1].astype(float) - sheet)[tool[2]]
    assert off.std() < 0.6 * alone.std()


def test_what_no_frame_saw_grows_from_each_frames_own_rim():
    """The whole sheet darkens at once; what was invented before it did does not stay bright at the rim."""
    rgb = operated(1, SIZE)[0].repeat(6, 0)
    tool = operated(1, SIZE)[1].repeat(6, 0)
    dark = rgb.copy()
    dark[3:] = dark[3:] // 2
    result = filled(dark, tool, margin=0)
    rim = tool[0] & ~cv2.erode(tool[0].astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    bright, late = (result.rgb[t][rim].astype(float).mean() for t in (0, 5))
    assert late < 0.7 * bright


def test_a_pixel_is_copied_from_no_farther_than_asked():
    rgb, tool, _ = passing()
    near, far = filled(rgb, tool, reach=1), filled(rgb, tool)
    assert (near.origin == COPIED).sum() < (far.origin == COPIED).sum()


def test_a_hole_at_the_edge_of_a_smooth_picture_continues_smoothly():
    y, x = np.mgrid[:60, :80].astype(np.float32)
    ramp = 100 + x - 0.5 * y
    known = np.ones(ramp.shape, bool)
    known[20:40, 60:] = False
    assert np.abs(continued(ramp, known) - ramp)[~known].max() < 20
    assert np.array_equal(continued(ramp, known)[known], ramp[known])


def test_filling_twice_gives_the_same_bytes():
    rgb, tool, _ = passing(8)
    assert filled(rgb, tool).encode({}) == filled(rgb, tool).encode({})


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"backend": "flow_cpoy"}, "Choose one of them"),
        ({"backend": "network"}, "no path is given"),
        ({"backend": "network", "weights": "nowhere/net.pt"}, "nowhere/net.pt is not there"),
    ],
)
def test_settings_that_cannot_be_followed_are_refused_in_one_sentence(settings, words):
    rgb, tool, _ = passing(4)
    with pytest.raises(Problem) as refused:
        filled(rgb, tool, **settings)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_file_that_is_no_network_is_refused(tmp_path):
    rgb, tool, _ = passing(4)
    for name, words in (("net.pt", "TorchScript"), ("net.onnx", "ONNX"), ("net.bin", "is wanted")):
        (tmp_path / name).write_bytes(b"no network")
        with pytest.raises(Problem, match=words):
            filled(rgb, tool, backend="network", weights=tmp_path / name)


def test_a_network_fills_only_what_no_frame_saw(tmp_path):
    import torch

    class Green(torch.nn.Module):
        def forward(self, image: torch.Tensor, hole: torch.Tensor) -> torch.Tensor:
            return image * (1 - hole) + hole * torch.tensor([0.0, 1.0, 0.0]).reshape(1, 3, 1, 1)

    torch.jit.script(Green()).save(str(tmp_path / "green.pt"))
    rgb, tool = operated(4, (H + 1, W + 3), shift=0.0)
    result = filled(rgb, tool, backend="network", weights=tmp_path / "green.pt")
    invented = result.origin == INVENTED
    assert invented.any()
    assert (np.abs(result.rgb[invented].astype(int) - [0, 255, 0]) <= 1).mean() > 0.98
    assert np.array_equal(result.rgb[result.origin == SEEN], rgb[result.origin == SEEN])


@pytest.mark.parametrize("side", ["any", 64])
def test_a_network_as_onnx_fills_the_same_at_any_size_and_at_its_only_one(tmp_path, side):
    pytest.importorskip("onnxruntime")
    height, width = ("h", "w") if side == "any" else (side, side)
    green = write(
        tmp_path / "green.onnx",
        {"image": (1, 3, height, width), "hole": (1, 1, height, width)},
        [
            ("Sub", ["one", "hole"], "seen", {}),
            ("Mul", ["image", "seen"], "kept", {}),
            ("Mul", ["hole", "green"], "new", {}),
            ("Add", ["kept", "new"], "filled", {}),
        ],
        {"filled": (1, 3, height, width)},
        one=np.ones((1, 1, 1, 1)),
        green=np.array([0, 1, 0]).reshape(1, 3, 1, 1),
    )
    rgb, tool = operated(4, (H + 1, W + 3), shift=0.0)
    result = filled(rgb, tool, backend="network", weights=green)
    invented = result.origin == INVENTED
    assert (np.abs(result.rgb[invented].astype(int) - [0, 255, 0]).max(-1) <= 60).mean() > 0.9
    assert np.array_equal(result.rgb[result.origin == SEEN], rgb[result.origin == SEEN])


@pytest.mark.parametrize("flow", ["dis", "raft"])
def test_the_flow_that_is_chosen_is_asked(flow, monkeypatch):
    rgb, tool, _ = passing(4)
    asked = []

    def prepared(weights):
        asked.append(weights)
        return lambda a, b: np.zeros((*a.shape[:2], 2), np.float32)

    monkeypatch.setattr(f"surgisim.perception.optical_flow.{flow}.prepared", prepared)
    filled(rgb, tool, flow=flow, flow_weights="raft.safetensors")
    assert asked == [Path("raft.safetensors")]


def test_masks_of_another_clip_are_refused():
    rgb, tool, _ = passing(4)
    with pytest.raises(Problem, match="Run masking on these frames"):
        filled(rgb[:3], tool)


def test_an_instrument_that_covers_everything_is_refused():
    rgb, tool, _ = passing(4)
    with pytest.raises(Problem, match="covers every frame"):
        filled(rgb, tool | True)


def test_a_hole_of_any_number_of_pixels_is_filled():
    """OpenCV reads at most 32,767 places in a row; a wide instrument in a frame of 640 x 512 hides more."""
    rgb = np.repeat(tissue(3, (260, 300))[None], 3, 0)
    tool = np.zeros(rgb.shape[:3], bool)
    tool[1, 20:240, 20:280] = True
    result = filled(rgb, tool)
    assert (result.origin[tool] == COPIED).all()
    assert np.abs(result.rgb.astype(int) - rgb).max() < 45
