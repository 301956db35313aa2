import cv2
import numpy as np
import pytest
import torch
from recordings import tissue
from safetensors.torch import save_file

from surgisim.perception.optical_flow.choice import chosen
from surgisim.perception.optical_flow.raft import Raft
from surgisim.perception.tracking.warp import follow_surface
from surgisim.problem import Problem


def shifted(frame, dx, dy):
    turn = np.float32([[1, 0, dx], [0, 1, dy]])
    size = frame.shape[1::-1]
    return cv2.warpAffine(frame, turn, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    """A network that was never trained, in the published form: half precision, nothing about batches."""
    torch.manual_seed(0)
    held = {name: tensor.half() for name, tensor in Raft().state_dict().items() if "num_batches" not in name}
    path = tmp_path_factory.mktemp("weights") / "raft-random.safetensors"
    save_file({name: tensor.clone() for name, tensor in held.items()}, path)
    return path


@pytest.mark.parametrize("size", [(64, 80), (50, 77)])
@pytest.mark.parametrize("name", ["auto", "dis", "raft"])
def test_every_backend_gives_a_displacement_for_each_pixel_of_frames_in_colour_and_grey(name, size, weights):
    flow = chosen(name, weights, stage="correspondence")
    a, b = tissue(1, size), tissue(2, size)
    for one, other in ((a, b), (a[..., 0], b[..., 0])):
        found = flow(one, other)
        assert found.shape == (*size, 2)
        assert found.dtype == np.float32
        assert np.isfinite(found).all()
        assert np.array_equal(found, flow(one, other))


def test_trained_raft_tells_a_shift_and_a_bend_to_three_tenths_of_a_pixel(shared):
    flow = chosen("raft", shared / "weights/raft-sintel-fp16.safetensors", stage="correspondence")
    frame = tissue(3, (128, 160))
    inner = slice(16, -16)
    off = flow(frame, shifted(frame, 4.3, -2.6)) - [4.3, -2.6]
    assert np.linalg.norm(off, axis=-1)[inner, inner].mean() < 0.3
    y, x = np.mgrid[:128, :160].astype(np.float32)
    bend = np.stack([3 * np.sin(y / 25), 2 * np.cos(x / 30)], -1).astype(np.float32)
    pulled = cv2.remap(frame, x + bend[..., 0], y + bend[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    off = flow(pulled, frame) - bend
    assert np.linalg.norm(off, axis=-1)[inner, inner].mean() < 0.3


def test_another_networks_file_and_one_that_is_none_are_refused_in_one_sentence(tmp_path, weights):
    other, damaged = tmp_path / "other.safetensors", tmp_path / "damaged.safetensors"
    save_file({"lin0.weight": torch.zeros(2)}, other)
    damaged.write_bytes(weights.read_bytes()[:1000])
    for path, words in (
        (None, "none is named"),
        (tmp_path / "nowhere", "is not there"),
        (other, "holds another network"),
        (damaged, "cannot be read as a safetensors file"),
    ):
        with pytest.raises(Problem, match=words) as refused:
            chosen("raft", path, stage="correspondence")
        assert "flow: dis" in str(refused.value)
        assert "\n" not in str(refused.value)


def test_weights_that_are_no_numbers_are_refused(tmp_path):
    held = {name: tensor.half() for name, tensor in Raft().state_dict().items() if "num_batches" not in name}
    held["fnet.conv2.bias"][0] = float("nan")
    save_file({name: tensor.clone() for name, tensor in held.items()}, tmp_path / "raft.safetensors")
    with pytest.raises(Problem, match="no numbers"):
        chosen("raft", tmp_path / "raft.safetensors", stage="inpainting")


def test_a_flow_that_there_is_not_is_named_with_those_that_there_are():
    with pytest.raises(Problem, match=r"'inpainting.flow' is 'rfat'.*\['dis', 'raft'\]"):
        chosen("rfat", None, stage="inpainting")


def test_the_surface_is_found_far_away_by_a_flow_that_reaches_there():
    """All jumps by a quarter of the frame: too far for steps that are looked for near by."""
    frame = tissue(4, (96, 128))
    rgb, hidden = np.stack([frame, shifted(frame, 18, 0)]), np.zeros((2, 96, 128), bool)
    true = np.broadcast_to(np.float32([18, 0]), (96, 128, 2))
    grid = np.stack(np.meshgrid(np.arange(128.0), np.arange(96.0)), -1)

    def right(far) -> float:
        *_, warp = follow_surface(rgb, hidden, far=far)
        near = np.linalg.norm(warp.position - grid - true, axis=-1) < 0.5
        return float((near & warp.seen)[8:-8, 8:-26].mean())

    assert right(None) < 0.2
    assert right(lambda a, b: true.copy()) > 0.9
