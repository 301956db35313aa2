import numpy as np
import pytest

from surgisim.perception.depth import depth_anything
from surgisim.problem import Problem

RGB = np.random.default_rng(0).integers(0, 255, (2, 40, 56, 3), dtype=np.uint8)
NONE = np.zeros(RGB.shape[:3], bool)


@pytest.fixture(scope="module", params=["relative", "metric"])
def weights(request, tmp_path_factory):
    torch = pytest.importorskip("torch")
    transformers = pytest.importorskip("transformers")
    torch.manual_seed(0)
    backbone = transformers.Dinov2Config(
        hidden_size=16,
        num_hidden_layers=4,
        num_attention_heads=2,
        image_size=56,
        patch_size=14,
        out_features=["stage1", "stage2", "stage3", "stage4"],
        reshape_hidden_states=False,
        apply_layernorm=True,
    )
    config = transformers.DepthAnythingConfig(
        backbone_config=backbone,
        reassemble_hidden_size=16,
        neck_hidden_sizes=[8, 8, 8, 8],
        fusion_hidden_size=8,
        head_hidden_size=8,
        depth_estimation_type=request.param,
        max_depth=1,
    )
    folder = tmp_path_factory.mktemp(request.param)
    transformers.DepthAnythingForDepthEstimation(config).save_pretrained(folder)
    return folder, request.param


def test_a_saved_network_gives_finite_depth_of_the_frames_size(weights):
    folder, kind = weights
    z, trust, scale = depth_anything.estimate(RGB, NONE, folder, distance=0.07, range_=2.0, side=42)
    assert z.shape == trust.shape == NONE.shape
    assert np.isfinite(z).all()
    assert (z > 0).all()
    assert scale == ("known" if kind == "metric" else "arbitrary")
    if kind == "relative":
        assert np.isclose(np.median(z[0]), 0.07, rtol=0.05)


def test_a_folder_without_weights_is_named_and_so_is_the_default(tmp_path):
    with pytest.raises(Problem, match=r"config\.json.*Depth-Anything-V2-Small-hf.*near_light"):
        depth_anything.estimate(RGB, NONE, tmp_path / "nowhere", distance=0.07, range_=2.0)
    (tmp_path / "config.json").write_text('{"model_type": "depth_anything"}')
    with pytest.raises(Problem, match=r"model\.safetensors"):
        depth_anything.estimate(RGB, NONE, tmp_path, distance=0.07, range_=2.0)


def test_frames_of_another_scale_and_offset_are_brought_together():
    near = np.random.default_rng(1).random((30, 40)).astype(np.float32)
    found = np.stack([near, 3 * near + 2, 0.5 * near - 1])
    found[1, :5] += 4
    aligned = depth_anything._aligned(found, np.ones(found.shape, bool))
    assert np.allclose(aligned[1, 5:], near[5:], atol=0.02)
    assert np.allclose(aligned[2], near, atol=1e-3)
