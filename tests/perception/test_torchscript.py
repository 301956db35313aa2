"""A network's file executes nothing but the network."""

import os
import pickle
import zipfile
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from surgisim.config.inpainting import Inpainting
from surgisim.config.tracking import Tracking
from surgisim.perception.inpainting import network
from surgisim.perception.torchscript import torchscript
from surgisim.perception.tracking import cotracker
from surgisim.problem import Problem


class Call:
    """What runs a command when it is unpickled."""

    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return os.system, (f"touch {self.mark}",)


class Plain(torch.nn.Module):
    def __init__(self):
        super().__init__()
        self.layer, self.norm = torch.nn.Conv2d(3, 4, 3), torch.nn.BatchNorm2d(4)
        self.sizes = [1, 2]

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return self.norm(self.layer(x))


class Writing(torch.nn.Module):
    def forward(self, x: torch.Tensor) -> torch.Tensor:
        torch.save(x, "written")
        return x


def swapped(path, into, member: str, content: bytes):
    """The archive with the content of one member another."""
    with zipfile.ZipFile(path) as archive, zipfile.ZipFile(into, "w") as changed:
        for name in archive.namelist():
            changed.writestr(name, content if name.endswith(member) else archive.read(name))
    return into


@pytest.fixture
def honest(tmp_path):
    path = tmp_path / "honest.pt"
    torch.jit.script(Plain()).save(str(path))
    return path


def evil_files(tmp_path, honest):
    call = Call(tmp_path / "executed")
    torch.save(call, tmp_path / "saved.pt")
    torch.save(call, tmp_path / "old.pt", _use_new_zipfile_serialization=False)
    (tmp_path / "bare.pt").write_bytes(pickle.dumps(call))
    yield from (tmp_path / name for name in ("saved.pt", "old.pt", "bare.pt"))
    for protocol in (2, 4):
        for member in ("/constants.pkl", "/data.pkl"):
            name = f"{member[1:-4]}{protocol}.pt"
            yield swapped(honest, tmp_path / name, member, pickle.dumps(call, protocol))


def test_a_network_is_loaded_scripted_or_traced(tmp_path, honest):
    traced = tmp_path / "traced.pt"
    torch.jit.trace(Plain().eval(), torch.zeros(1, 3, 8, 8)).save(str(traced))
    for path in (honest, traced):
        assert torchscript(path, export="")(torch.zeros(1, 3, 8, 8)).shape == (1, 4, 6, 6)


def test_a_pickle_that_runs_a_command_is_refused_and_runs_nothing(tmp_path, honest):
    for path in evil_files(tmp_path, honest):
        with pytest.raises(Problem, match="nothing of it was loaded") as refused:
            torchscript(path, export="Export it anew.")
        assert path.name in str(refused.value)
        assert "\n" not in str(refused.value)
    assert not (tmp_path / "executed").exists()


def test_every_backend_that_takes_torch_files_refuses_such_a_pickle(tmp_path, honest):
    rgb, hidden = np.zeros((2, 16, 16, 3), np.uint8), np.zeros((2, 16, 16), bool)
    hidden[:, 4:8, 4:8] = True
    for path in evil_files(tmp_path, honest):
        with pytest.raises(Problem, match="flow_copy"):
            network.fill(rgb, hidden, Inpainting(weights=path), lambda *_: None)
        settings = Tracking(weights=path)
        with pytest.raises(Problem, match="flow_chain"):
            cotracker.track(rgb, SimpleNamespace(hidden=hidden), hidden, np.zeros((1, 2)), settings=settings)
    assert not (tmp_path / "executed").exists()


def test_a_program_that_writes_files_is_refused(tmp_path):
    torch.jit.script(Writing()).save(str(tmp_path / "writing.pt"))
    with pytest.raises(Problem, match=r"uses 'torch\.save'"):
        torchscript(tmp_path / "writing.pt", export="")


def test_a_damaged_file_is_refused(tmp_path, honest):
    short = tmp_path / "short.pt"
    short.write_bytes(honest.read_bytes()[:500])
    with pytest.raises(Problem, match="no TorchScript file"):
        torchscript(short, export="")
    with pytest.raises(Problem, match="damaged pickle"):
        torchscript(swapped(honest, tmp_path / "torn.pt", "/data.pkl", b"\x80\x02c"), export="")
