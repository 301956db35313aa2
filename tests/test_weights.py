import pytest

from surgisim.plan import plan
from surgisim.problem import Problem
from surgisim.weights import KINDS, filled, found


@pytest.fixture
def folder(tmp_path):
    for name in (
        "sam2_hiera_tiny_encoder_w8.onnx",
        "sam2_hiera_tiny_decoder_w8.onnx",
        "lpips_alex.safetensors",
        "raft-sintel-fp16.safetensors",
        "README",
    ):
        (tmp_path / name).touch()
    return tmp_path


def test_files_are_found_by_their_names(folder):
    assert {setting: path.name for setting, path in found(folder).items()} == {
        "masking.encoder": "sam2_hiera_tiny_encoder_w8.onnx",
        "masking.decoder": "sam2_hiera_tiny_decoder_w8.onnx",
        "evaluation.lpips_weights": "lpips_alex.safetensors",
        "correspondence.flow_weights": "raft-sintel-fp16.safetensors",
        "inpainting.flow_weights": "raft-sintel-fp16.safetensors",
    }


def test_only_what_a_run_reads_comes_into_its_settings_and_what_it_names_wins(folder):
    there = found(folder)
    assert filled({"masking": {"backend": "colour_motion"}}, there) == {
        "masking": {"backend": "colour_motion"},
        "evaluation": {"lpips_weights": str(folder / "lpips_alex.safetensors")},
    }
    mine = {"masking": {"backend": "sam2", "encoder": "mine.onnx"}, "evaluation": {"lpips_weights": "mine"}}
    assert filled(mine, there) == {
        "masking": {"backend": "sam2", "encoder": "mine.onnx", "decoder": str(there["masking.decoder"])},
        "evaluation": {"lpips_weights": "mine"},
    }


def test_auto_reads_what_it_would_take_and_nothing_else(folder):
    there, click = found(folder), {"frame": 0, "x": 1, "y": 2}
    both = {key: str(there[f"masking.{key}"]) for key in ("encoder", "decoder")}
    for said in ({"clicks": [click]}, {"backend": "auto", "clicks": [click]}):
        assert filled({"masking": said}, there)["masking"] == said | both
    for said in ({"backend": "auto"}, {"backend": "given", "clicks": [click]}):
        assert filled({"masking": said}, there)["masking"] == said
    for stage in ("correspondence", "inpainting"):
        assert filled({stage: {"flow": "auto"}}, there)[stage] == {"flow": "auto"}
        raft = {"flow": "raft", "flow_weights": str(there[f"{stage}.flow_weights"])}
        assert filled({stage: {"flow": "raft"}}, there)[stage] == raft


def test_no_folder_and_two_files_for_one_are_said(folder):
    with pytest.raises(Problem, match="nowhere is no folder"):
        found(folder / "nowhere")
    (folder / "lpips_vgg.safetensors").touch()
    with pytest.raises(Problem, match=r"holds lpips_alex.safetensors, lpips_vgg.safetensors, all for evaluation.lpips"):
        found(folder)


def test_a_plan_has_them(folder, tmp_path):
    (tmp_path / "clips.tsv").write_text("name\tpath\na\tphantom\n")
    (tmp_path / "variants.yaml").write_text("main: {}\n")
    said = {"weights": str(folder)}
    made = plan(said, clips=tmp_path / "clips.tsv", variants=tmp_path / "variants.yaml")
    assert "lpips_alex.safetensors" in made.slices["evaluation", "a", "main"]
    assert "onnx" not in made.slices["masking", "a", "main"]
    assert "safetensors" not in made.slices["correspondence", "a", "main"]
    said |= {"masking": {"clicks": [{"frame": 0, "x": 1, "y": 2}]}, "correspondence": {"flow": "raft"}}
    made = plan(said, clips=tmp_path / "clips.tsv", variants=tmp_path / "variants.yaml")
    assert "onnx" in made.slices["masking", "a", "main"]
    assert "safetensors" in made.slices["correspondence", "a", "main"]


def test_every_kind_names_a_setting_that_there_is():
    from surgisim.config.whole import Whole

    for kind in KINDS:
        stage, key = kind.setting.split(".")
        assert key in Whole.model_fields[stage].annotation.model_fields
