"""A recording's folder comes back as it was written, and what is wrong with one is said in one sentence."""

import json
import pickle
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from solids import box, recording

from surgisim.problem import Problem
from surgisim.recordings.folder import is_recording, read_recording, write_recording
from surgisim.recordings.mesh import closed
from surgisim.recordings.ply import read_mesh


@pytest.fixture
def folder(tmp_path):
    write_recording(recording(), tmp_path / "r-1")
    return tmp_path / "r-1"


def edit(path, **changes):
    body = json.loads(path.read_text()) | changes
    path.write_text(json.dumps({k: v for k, v in body.items() if v != "gone"}))


def put(path, **arrays):
    with np.load(path) as archive:
        kept = {k: archive[k] for k in archive.files}
    np.savez(path, **{k: v for k, v in (kept | arrays).items() if v is not None})


@pytest.mark.parametrize("changes", [{}, {"grips": 0, "density": None, "gravity": None, "split": None}])
def test_what_is_written_is_read(tmp_path, changes):
    made = recording(**changes)
    write_recording(made, tmp_path)
    read = read_recording(tmp_path)
    assert is_recording(tmp_path)
    for name in ("name", "fps", "density", "gravity", "tier", "starts", "split", "place"):
        assert getattr(read, name) == getattr(made, name)
    for name in ("boxes", "points", "visible", "sigma"):
        np.testing.assert_array_equal(getattr(read, name), getattr(made, name))
    for name in ("center_rest", "radius", "position", "active", "source"):
        np.testing.assert_array_equal(getattr(read.motion, name), getattr(made.motion, name))
    np.testing.assert_array_equal(read.mesh.vertices, made.mesh.vertices)


def test_the_same_recording_is_the_same_bytes(tmp_path):
    for name in "ab":
        write_recording(recording(), tmp_path / name)
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()


def test_millimetres_become_metres(folder, monkeypatch):
    # The body of these tests is then smaller than any that is accepted.
    monkeypatch.setattr("surgisim.recordings.folder.LEAST", 1e-6)
    edit(folder / "recording.json", length_unit="mm")
    read, made = read_recording(folder), recording()
    assert read.mesh.volume == pytest.approx(1e-9 * made.mesh.volume)
    np.testing.assert_allclose(read.points, made.points / 1000, rtol=1e-6)
    np.testing.assert_allclose(read.motion.position, made.motion.position / 1000)
    np.testing.assert_allclose([*read.boxes.ravel(), *read.sigma], [*made.boxes.ravel() / 1000, *made.sigma / 1000])


@pytest.mark.parametrize("gone", ["grip.npz", "split.json"])
def test_a_recording_needs_no_grips_and_no_split(folder, gone):
    (folder / gone).unlink()
    read = read_recording(folder)
    assert (len(read.motion.active) == 0) if gone == "grip.npz" else read.split is None


@pytest.mark.parametrize(
    ("spans", "until"),
    [
        ([], 42),
        ([(5, 40)], 42),
        ([(10, 40), (11, 30)], 42),
        ([(10, 30), (40, 55)], 38),
        ([(10, 30), (20, 35), (40, 55)], 38),
        ([(2, 4), (6, 55)], 42),
    ],
    ids=["no grip", "one", "two at once", "one after the other", "two, then a third", "a touch before anything"],
)
def test_without_a_split_the_second_manipulation_is_held_out_or_the_last_frames(spans, until):
    made = recording(grips=len(spans), frames=60, split=None)
    active = np.array([[first <= t < last for t in range(60)] for first, last in spans], bool).reshape(-1, 60)
    made = replace(made, motion=replace(made.motion, active=active))
    assert (made.fitted_until, made.held_out) == (until, (until, 60))
    made = replace(made, split={"fit": (0, 20), "held_out": (25, 50)})
    assert (made.fitted_until, made.held_out) == (20, (25, 50))


def test_a_grip_that_has_let_go_needs_no_position(folder):
    made = recording()
    active, position = made.motion.active.copy(), made.motion.position.copy()
    active[:, 4:], position[:, 4:] = False, np.nan
    put(folder / "grip.npz", active=active, position=position)
    motion = read_recording(folder).motion
    np.testing.assert_array_equal(motion.position[0, 4:], motion.position[0, [3, 3]])


@pytest.mark.parametrize("order", ["ascii", "binary_big_endian", "binary_little_endian"])
def test_any_ply_writer_will_do(folder, order):
    mesh = box()
    head = f"ply\nformat {order} 1.0\ncomment made elsewhere\nelement vertex 8\nproperty float x\nproperty float y\n"
    head += "property float z\nproperty uchar red\nelement face 12\nproperty list uchar uint vertex_index\nend_header\n"
    if order == "ascii":
        rows = [f"{x} {y} {z} 7" for x, y, z in mesh.vertices] + [f"3 {a} {b} {c}" for a, b, c in mesh.faces]
        (folder / "rest.ply").write_text(head + "\n".join(rows) + "\n")
    else:
        sign = "<" if "little" in order else ">"
        v = np.zeros(8, [("p", f"{sign}f4", 3), ("red", "u1")])
        f = np.zeros(12, [("n", "u1"), ("v", f"{sign}u4", 3)])
        v["p"], f["n"], f["v"] = mesh.vertices, 3, mesh.faces
        (folder / "rest.ply").write_bytes(head.encode() + v.tobytes() + f.tobytes())
    assert read_recording(folder).mesh.volume == pytest.approx(closed(mesh, "box").volume, rel=1e-6)


def test_a_point_follows_the_tissue_where_it_is_first_seen(tmp_path):
    made = recording()
    made.points[0, :2] = np.nan
    made.visible[0, :2] = False
    made.points[0, 2] = [0.012, 0.01, 0.02]
    np.testing.assert_allclose(made.attached()[0], [0.012, 0.01, 0.02], rtol=1e-6)
    place = np.zeros((4, 3))
    write_recording(recording(place=place), tmp_path)
    np.testing.assert_array_equal(read_recording(tmp_path).attached(), place)


def test_a_point_seen_at_rest_follows_the_tissue_where_it_is_on_average(tmp_path):
    made, grasp = recording(), 3
    made.motion.active[:, :grasp] = False
    made.points[:, 0] += np.random.default_rng(2).normal(0, 1e-4, (4, 3))
    np.testing.assert_allclose(made.attached(), np.nanmean(made.points[:, :grasp], 1), rtol=1e-6)
    made.points[0, 0], made.visible[0, 0] = np.nan, False
    np.testing.assert_allclose(made.attached()[0], made.points[0, 1:grasp].mean(0), rtol=1e-6)
    let_go = replace(made, starts="released")
    np.testing.assert_array_equal(let_go.attached()[1:], made.points[1:, 0])


JSON = [
    ({"format": "another/1"}, "its format is 'another/1'"),
    ({"name": "gone"}, r"lacks \['name'\]"),
    ({"fps": 0}, "'fps' is 0"),
    ({"fps": "25"}, "'fps' is '25'"),
    ({"frames": 2.5}, "'frames' is 2.5"),
    ({"frames": 7}, r"'points' is \(4, 6, 3\), but \(K, T, 3\) is wanted, with T 7"),
    ({"length_unit": "furlong"}, "'length_unit' is 'furlong'"),
    ({"length_unit": "mm"}, "the body is 4e-05 m long, but between 0.001 and 10 m are wanted. Mend 'length_unit'"),
    ({"density_kg_m3": -1}, "'density_kg_m3' is -1"),
    ({"gravity_m_s2": [0, 9.81]}, r"'gravity_m_s2' is \[0, 9.81\]"),
    ({"tier": None}, "'tier' is None"),
    ({"starts": "falling"}, "'starts' is 'falling'"),
    ({"doubts": "depth"}, "'doubts' is 'depth', but a list of names is wanted"),
    ({"astray": -0.1}, "'astray' is -0.1, but a share of how far points go is wanted"),
    ({"doubts": ["depth"]}, "'doubts' has 1 names, and tracks.npz has doubts of 0 things"),
]


@pytest.mark.parametrize(("changes", "told"), JSON)
def test_a_wrong_fact_is_named(folder, changes, told):
    edit(folder / "recording.json", **changes)
    refused(folder, told)


ARRAYS = [
    ("tracks.npz", {"points": None}, "lacks 'points'"),
    ("tracks.npz", {"sigma": np.ones(3)}, r"'sigma' is \(3,\), but \(K,\) is wanted"),
    ("tracks.npz", {"sigma": -np.ones(4)}, "sigma must be finite and not negative"),
    ("tracks.npz", {"visible": np.ones((4, 6), bool)}, "point 1 is called visible in frame 2"),
    ("tracks.npz", {"visible": np.zeros((4, 6), bool)}, "point 0 is never visible"),
    ("tracks.npz", {"points": np.full((4, 6, 3), "a")}, "'points' holds <U1"),
    ("tracks.npz", {"place": np.zeros((3, 3))}, r"'place' is \(3, 3\)"),
    ("tracks.npz", {"ways": np.tile(np.eye(3), (4, 1, 1))}, "directions of axes, which are missing"),
    ("tracks.npz", {"axes": np.ones((4, 3)), "ways": np.ones((4, 3, 3))}, "ways of point 0 are not of length 1"),
    ("tracks.npz", {"doubts": np.zeros((1, 4, 5, 3))}, r"'doubts' is \(1, 4, 5, 3\)"),
    ("tracks.npz", {"doubts": np.zeros((1, 4, 6, 3))}, "has doubts of 1 things"),
    ("grip.npz", {"radius": np.zeros(1)}, "radius 0 is not positive"),
    ("grip.npz", {"position": np.full((1, 6, 3), np.nan)}, "a grip that holds has a position that is not a number"),
    ("grip.npz", {"active": np.ones((1, 5), bool)}, r"'active' is \(1, 5\), but \(J, T\) is wanted"),
    ("grip.npz", {"active": None}, "lacks 'active'"),
]


@pytest.mark.parametrize(("name", "changes", "told"), ARRAYS)
def test_a_wrong_array_is_named(folder, name, changes, told):
    put(folder / name, **changes)
    refused(folder, told)


TEXTS = [
    ("recording.json", "{", "is not JSON"),
    ("recording.json", "[]", "holds a list"),
    ("fixed.json", "{}", "lacks a list 'boxes'"),
    ("fixed.json", '{"boxes": [{"min": [0, 0, 0]}]}', "box 0 is"),
    ("fixed.json", '{"boxes": [{"min": [0, 0, 1], "max": [1, 1, 0]}]}', "above its 'max'"),
    ("fixed.json", '{"boxes": [], "torn": 3}', "'torn' is 3"),
    ("fixed.json", '{"boxes": [], "torn": [[[0, 1], [2]]]}', "wall 0 of 'torn' is"),
    ("split.json", '{"fit": [0, 9], "held_out": [4, 6]}', r"'fit' is \[0, 9\]"),
    ("split.json", '{"fit": [0, 5], "held_out": [4, 6]}', "overlap"),
    ("split.json", '{"fit": [2, 2], "held_out": [4, 6]}', "leaves no frame to fit"),
    ("rest.ply", "solid box", "is not a PLY file"),
    ("rest.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n", "its vertices lack"),
    ("tracks.npz", "PK", "cannot be read as plain arrays"),
    ("grip.npz", "", "cannot be read as plain arrays"),
]


@pytest.mark.parametrize(("name", "text", "told"), TEXTS)
def test_a_broken_file_is_named(folder, name, text, told):
    (folder / name).write_text(text)
    refused(folder, told, name)


@pytest.mark.parametrize("name", ["recording.json", "rest.ply", "fixed.json", "tracks.npz"])
def test_a_missing_file_is_named(folder, name):
    (folder / name).unlink()
    refused(folder, "no such file", name)


def test_nothing_is_unpickled(folder):
    for content in (pickle.dumps({"points": 1}), None):
        if content is None:
            np.savez(folder / "tracks.npz", points=np.array([{}], object))
        else:
            (folder / "tracks.npz").write_bytes(content)
        refused(folder, "cannot be read as plain arrays")


@pytest.mark.parametrize(("shape", "held"), [((10**15,), 8), ((60_000, 60_000), 8), ((2,), 24)])
def test_an_array_that_announces_another_size_than_it_has_is_refused(folder, shape, held):
    put(folder / "tracks.npz", **{"points": None})
    with zipfile.ZipFile(folder / "tracks.npz", "a") as archive, archive.open("points.npy", "w") as member:
        np.lib.format.write_array_header_1_0(member, {"descr": "<f8", "fortran_order": False, "shape": shape})
        member.write(bytes(held))
    refused(folder, "announces", "tracks.npz")


def test_arrays_that_would_fill_the_memory_are_refused(folder, monkeypatch):
    monkeypatch.setattr("surgisim.recordings.arrays.MOST", 100)
    refused(folder, "at most 0.0 GB are read")


def test_a_mesh_that_is_cut_short_is_named(folder):
    (folder / "rest.ply").write_bytes((folder / "rest.ply").read_bytes()[:-5])
    refused(folder, "is cut short; 12 of 'face' are announced")


def test_squares_are_refused(tmp_path):
    head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    head += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    (tmp_path / "a.ply").write_text(head + "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n")
    with pytest.raises(Problem, match="a face has 4 corners"):
        read_mesh(tmp_path / "a.ply")


def refused(folder, told, name=""):
    with pytest.raises(Problem, match=told) as caught:
        read_recording(folder)
    sentence = str(caught.value)
    assert name in sentence
    assert "\n" not in sentence


def test_what_goes_along_at_the_edge_is_kept(tmp_path):
    made = recording()
    frames = made.motion.active.shape[1]
    rim = np.arange(2.0 * frames * 3).reshape(2, frames, 3)
    write_recording(replace(made, motion=replace(made.motion, rim=rim, rim_radius=np.array([0.1, 0.2]))), tmp_path)
    read = read_recording(tmp_path).motion
    np.testing.assert_array_equal(read.rim, rim)
    np.testing.assert_array_equal(read.rim_radius, [0.1, 0.2])
    put(tmp_path / "grip.npz", rim_radius=None)
    with pytest.raises(Problem, match="has only 'rim' of 'rim' and 'rim_radius'"):
        read_recording(tmp_path)
