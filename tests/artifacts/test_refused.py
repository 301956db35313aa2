"""A file between stages that is not what it says is refused in one sentence, and nothing in it is executed."""

import io
import os
import pickle
import zipfile

import numpy as np
import pytest

from surgisim.artifacts.base import load, save
from surgisim.artifacts.frames import Frames
from surgisim.problem import Problem


class Bomb:
    def __reduce__(self):
        return (os._exit, (3,))


def member(array=None, *, shape=None):
    """The bytes of one .npy: an array, or a header that announces `shape` above eight bytes."""
    stream = io.BytesIO()
    if shape is None:
        np.lib.format.write_array(stream, array, allow_pickle=True)
    else:
        np.lib.format.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": shape})
        stream.write(bytes(8))
    return stream.getvalue()


@pytest.fixture
def path(tmp_path):
    frames = Frames(np.zeros((2, 4, 4, 3), np.uint8), np.zeros(2, np.uint8))
    save(frames, tmp_path / "frames.npz", producer="test", settings={}, code="")
    return tmp_path / "frames.npz"


def replaced(path, name, data):
    with zipfile.ZipFile(path) as archive:
        members = {n: archive.read(n) for n in archive.namelist()} | {name: data}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for each, content in members.items():
            archive.writestr(each, content)


def refused(path, told):
    with pytest.raises(Problem, match=told) as caught:
        load(Frames, path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_was_saved_is_read(path):
    assert load(Frames, path).rgb.shape == (2, 4, 4, 3)


def test_a_pickled_array_is_refused(path):
    replaced(path, "rgb.npy", member(np.array([Bomb()], object)))
    refused(path, "cannot be read as a Frames")


def test_a_bare_pickle_is_refused(path):
    path.write_bytes(pickle.dumps(Bomb()))
    refused(path, "cannot be read as a Frames")


def test_one_bare_array_is_refused(path):
    path.write_bytes(member(np.zeros(3)))
    refused(path, "cannot be read as a Frames")


@pytest.mark.parametrize("shape", [(10**15,), (60_000, 60_000, 3), (0,)])
def test_an_array_that_announces_another_size_than_it_has_is_refused(path, shape):
    replaced(path, "rgb.npy", member(shape=shape))
    refused(path, "announces")


def test_a_member_that_unpacks_to_more_than_deflate_can_pack_is_refused(path):
    data = bytearray(path.read_bytes())
    # The size in the list at the archive's end, which is what is believed.
    entry = data.index(b"PK\x01\x02")
    assert data[entry + 46 :].startswith(b"__header__.npy")
    data[entry + 24 : entry + 28] = (2**31).to_bytes(4, "little")
    path.write_bytes(bytes(data))
    refused(path, "claims 2147483648 bytes")


def test_a_cut_file_is_refused(path):
    path.write_bytes(path.read_bytes()[:-40])
    refused(path, "cannot be read as a Frames")
