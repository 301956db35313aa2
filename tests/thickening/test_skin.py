"""The surface around a body is closed, faces outward and encloses what it should."""

from dataclasses import replace

import numpy as np
import pytest
from slab import slab

from surgisim.artifacts.ply import read_ply
from surgisim.skin import alpha_shape, normals, skin, volume, watertight, width
from surgisim.thickening import mesh

SIZE = np.array([0.048, 0.036, 0.018])


def test_a_block_is_enclosed_up_to_the_outermost_centres():
    body = slab(tuple(SIZE))
    faces, place = skin(body), body.rest.astype(float)
    assert watertight(faces)
    assert volume(place, faces) == pytest.approx(np.prod(SIZE - width(body)), rel=2e-3)


def test_normals_point_out():
    body = slab(tuple(SIZE))
    place, middle = body.rest.astype(float), body.rest.mean(0)
    out = normals(place, skin(body))
    near = np.abs(place - middle) > SIZE / 2 - 0.75 * width(body)
    flat = near.sum(1) == 1
    assert out[flat] == pytest.approx(near[flat] * np.sign(place[flat] - middle), abs=0.02)
    assert not out[~near.any(1)].any()


def test_a_notch_is_left_out():
    body = slab(tuple(SIZE))
    place = body.rest.astype(float)
    notch = (np.abs(place[:, 0]) < 0.25 * SIZE[0]) & (place[:, 2] < place[:, 2].min() + 0.45 * SIZE[2])
    faces = skin(body, ~notch)
    assert watertight(faces)
    assert not notch[faces].any()
    # Half as wide and half as deep, and a particle more on each side of it.
    wide = width(body)
    gone = (SIZE[0] / 2 + wide) * (SIZE[1] - wide) * SIZE[2] / 2
    assert volume(place, faces) == pytest.approx(np.prod(SIZE - wide) - gone, rel=0.03)


def test_along_a_tear_it_has_two_sides():
    whole = slab(tuple(SIZE))
    torn = replace(whole, torn=np.array([[[0.0, -1.0], [0.0, 0.0]]]))
    faces, place = skin(torn), whole.rest.astype(float)
    assert watertight(faces)
    x, y = place[:, 0], place[:, 1]
    between = (np.sign(x[faces]).min(1) < np.sign(x[faces]).max(1)) & (y[faces].max(1) < 0)
    assert not between.any()
    wide = width(whole)
    assert volume(place, faces) == pytest.approx(
        volume(place, skin(whole)) - wide * SIZE[1] / 2 * (SIZE[2] - wide), rel=0.02
    )


def test_what_encloses_nothing_has_none():
    for points in np.zeros((3, 3)), np.random.default_rng(0).random((40, 3)):
        assert alpha_shape(points, 1e-3).shape == (0, 3)
    assert not watertight(np.empty((0, 3), int))


def test_the_mesh_file_holds_it(tmp_path):
    body, file = slab(tuple(SIZE)), tmp_path / "body_mesh.ply"
    file.write_bytes(mesh(body))
    columns, header = read_ply(file)
    assert header["kind"] == "Mesh"
    faces = skin(body)
    assert len(columns["x"]) == len(np.unique(faces))
    raw = file.read_bytes()
    assert f"element face {len(faces)}\n".encode() in raw
    rows = np.frombuffer(raw[-13 * len(faces) :], [("count", "u1"), ("corners", "<i4", 3)])
    assert (rows["count"] == 3).all()
    place = np.stack([columns[k] for k in "xyz"], 1).astype(float)
    assert watertight(rows["corners"])
    assert volume(place, rows["corners"]) == pytest.approx(np.prod(SIZE), rel=0.03)
