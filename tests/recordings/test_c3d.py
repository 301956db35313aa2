"""Markers of a C3D file, in metres, whatever way it keeps its numbers."""

import numpy as np
import pytest

from surgisim.problem import Problem
from surgisim.recordings.c3d import read_c3d

POINTS = np.random.default_rng(1).normal(size=(2, 4, 3)).round(2)


def take(unit="mm", whole=False, processor=84, labels=("Tip", "Base")) -> bytes:
    """Two markers in four frames, the second unseen in the last, with two analogue samples a frame."""

    def group(number, name):
        return bytes([len(name), 256 - number]) + name.encode() + (3).to_bytes(2, "little") + b"\0"

    def text(number, name, words):
        data = "".join(w.ljust(8) for w in words).encode()
        rest = bytes([255, 2, 8, len(words)]) + data + b"\0"
        return bytes([len(name), number]) + name.encode() + (len(rest) + 2).to_bytes(2, "little") + rest

    parameters = bytes([0, 0, 1, processor]) + group(1, "POINT") + text(1, "UNITS", [unit]) + text(1, "LABELS", labels)
    head = np.zeros(256, "<u2")
    head[:5] = [0x5002, 2, 2, 1, 4]
    head[6:8] = np.array([0.01 if whole else -0.01], "<f4").view("<u2")
    head[8] = 3
    head[10:12] = np.array([100.0], "<f4").view("<u2")
    frames = np.zeros((4, 10))
    frames[:, :8].reshape(4, 2, 4)[..., :3] = np.moveaxis(POINTS, 0, 1) / (0.01 if whole else 1)
    frames[3, 7] = -1
    frames = np.round(frames).astype("<i2") if whole else frames.astype("<f4")
    return head.tobytes() + (parameters + b"\0\0").ljust(512, b"\0") + frames.tobytes()


@pytest.mark.parametrize("whole", [False, True])
@pytest.mark.parametrize(("unit", "metres"), [("m", 1.0), ("mm", 1e-3)])
def test_positions_come_in_metres(tmp_path, whole, unit, metres):
    (tmp_path / "a.c3d").write_bytes(take(unit, whole))
    markers = read_c3d(tmp_path / "a.c3d")
    assert markers.labels == ("Tip", "Base")
    assert markers.fps == 100
    np.testing.assert_allclose(markers.points[0], POINTS[0] * metres, rtol=1e-5)
    np.testing.assert_allclose(markers.points[1, :3], POINTS[1, :3] * metres, rtol=1e-5)
    assert np.isnan(markers.points[1, 3]).all()


@pytest.mark.parametrize(
    ("raw", "told"),
    [
        (b"solid", "is not a C3D file"),
        (take(processor=86), "little-endian"),
        (take(unit="ft"), "lengths are in 'ft'"),
        (take()[:-1], "is cut short; 4 frames"),
    ],
)
def test_what_is_no_take_is_refused(tmp_path, raw, told):
    (tmp_path / "a.c3d").write_bytes(raw)
    with pytest.raises(Problem, match=told):
        read_c3d(tmp_path / "a.c3d")


@pytest.mark.shared
def test_a_real_take_has_its_markers(shared):
    markers = read_c3d(shared / "data" / "silicone_beam_mocap" / "beam_gravity_V2_a.c3d")
    assert markers.labels == ("Tip - 1", "Tip - 2", "Tip - 3", "Base - 1", "Base - 2", "Base - 3")
    assert markers.points.shape == (6, 500, 3)
    assert np.isfinite(markers.points).all()
    np.testing.assert_allclose(markers.points[0, 0], [0.07398, 0.03062, 0.07482], atol=1e-5)
