"""A clip's artifacts as a recording: the same body, the same boundary, the same points."""

import dataclasses

import numpy as np
import pytest
from slab import pulled, slab

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.doubts import Doubts
from surgisim.artifacts.fit import Fit
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.material import Material
from surgisim.artifacts.physics import Physics
from surgisim.artifacts.tracks import Tracks
from surgisim.problem import Problem
from surgisim.recordings.folder import read_recording, write_recording
from surgisim.recordings.of_clip import recording_of, surface

T = 24


def clip(seen=True):
    body, motion = slab(), pulled(frames=T)
    rest = body.rest[body.surface].astype(np.float32)
    k = len(rest)
    xyz = np.repeat(rest[:, None], T, 1)
    xyz[3, 5:9] = np.nan
    tracks = Tracks(
        np.zeros((k, T, 2), np.float32), np.full((k, T), seen), np.ones((k, T), np.float32), xyz,
        np.full((k, T, 2), 2e-4, np.float32),
    )  # fmt: skip
    material = Material(np.array(["corotated.E"]), np.ones((len(body.rest), 1), np.float32), body.held)
    physics = Physics(
        density=1050.0, form="total", gravity=[0.0, 0.0, 0.0], grid={"spacing": body.spacing, "step": 1e-3}, grip=1.0,
        places={}, terms={},
    )  # fmt: skip
    split = np.zeros(T, np.uint8)
    split[-5:] = 2
    camera = Camera(64, 48, 80.0, 80.0, 31.5, 23.5, 25.0, T, "known", "given", "slab", [64, 48], [0, 0, 64, 48])
    frames = Frames(np.zeros((T, 48, 64, 3), np.uint8), split)
    moved = np.zeros((1, k, T, 3), np.float32)
    moved[0, :, 8:, 0] = 1e-4
    doubts = Doubts(np.array(["held.depth"]), moved)
    known = {"low": 400.0, "high": 900.0, "at_edge": False}
    slow = {"low": 1e-3, "high": 4e-3, "at_edge": False}
    table = {"corotated.E": known, "corotated.nu": known, "newtonian.eta": known, "newtonian.eta / corotated.E": slow}
    return body, material, physics, tracks, motion, frames, camera, doubts, Fit([], table, {}, "")


def test_a_clip_survives_the_way_through_a_folder(tmp_path):
    body, *rest = clip()
    write_recording(recording_of("slab", body, *rest), tmp_path)
    back = read_recording(tmp_path)
    assert back.split == {"fit": (0, T - 5), "held_out": (T - 5, T)}
    assert back.doubts["held.depth"][:, 9] == pytest.approx(np.tile([1e-4, 0, 0], (len(back.points), 1)))
    assert back.expected == {"E": (400.0, 900.0), "eta / E": (1e-3, 4e-3)}
    assert not back.visible[3, 5:9].any()
    assert back.mesh.volume == pytest.approx(float(body.volume.sum()), rel=0.12)
    filled = back.body(body.spacing)
    assert filled.held.mean() == pytest.approx(body.held.mean(), abs=0.1)


def test_a_torn_clip_stays_torn(tmp_path):
    body, *rest = clip()
    walls = np.array([[[0.0, -0.01], [0.02, -0.01]], [[0.0, 0.01], [0.02, 0.01]]])
    write_recording(recording_of("slab", dataclasses.replace(body, torn=walls), *rest), tmp_path / "torn")
    assert read_recording(tmp_path / "torn").body(0.006).torn == pytest.approx(walls)
    write_recording(recording_of("slab", body, *rest), tmp_path / "whole")
    assert "torn" not in (tmp_path / "whole" / "fixed.json").read_text()
    assert not len(read_recording(tmp_path / "whole").body(0.006).torn)


def test_noise_across_and_along_the_view_survives_too(tmp_path):
    body, material, physics, tracks, *rest = clip()
    sigma = np.broadcast_to(np.float32([1e-4, 5e-4]), tracks.sigma_xyz.shape)
    found = recording_of("slab", body, material, physics, dataclasses.replace(tracks, sigma_xyz=sigma), *rest)
    ray = found.place / np.linalg.norm(found.place, axis=1, keepdims=True)
    covariance = np.einsum("kai,ka,kaj->kij", found.ways, found.noise**2, found.ways)
    wanted = 1e-8 * np.eye(3) + 24e-8 * ray[:, :, None] * ray[:, None]
    assert covariance == pytest.approx(wanted, abs=1e-12)
    assert found.sigma == pytest.approx(np.sqrt(9e-8), rel=1e-4)
    write_recording(found, tmp_path)
    back = read_recording(tmp_path)
    assert back.noise == pytest.approx(found.noise)
    assert back.ways == pytest.approx(found.ways)
    assert found.of(np.arange(3)).ways.shape == (3, 3, 3)


def test_that_tracks_go_astray_with_their_points_is_told_beside_the_noise(tmp_path):
    body, material, physics, tracks, *rest = clip()
    xyz = tracks.xyz.copy()
    xyz[0, 1:, 0] += 0.02
    found = recording_of("slab", body, material, physics, dataclasses.replace(tracks, xyz=xyz), *rest)
    assert found.noise[:, 0] == pytest.approx(2e-4, rel=1e-3)
    assert 0.02 < found.astray < 0.1
    write_recording(found, tmp_path)
    assert read_recording(tmp_path).astray == found.astray


def test_the_surface_encloses_the_body():
    body = slab()
    mesh = surface(body)
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    assert (np.abs(low - body.rest.min(0)) < 0.6 * body.spacing).all()
    assert (np.abs(high - body.rest.max(0)) < 0.6 * body.spacing).all()


def test_held_specks_that_the_surface_leaves_out_hold_nothing(tmp_path):
    body, *rest = clip()
    speck = body.rest.min(0) - 3 * body.spacing
    rows = ("rest", "volume", "color", "held", "surface")
    twice = {name: np.concatenate([getattr(body, name), getattr(body, name)[:1]]) for name in rows}
    more = dataclasses.replace(body, **twice)
    more.rest[-1] = speck
    more.held[-1], more.surface[-1] = True, False
    material = dataclasses.replace(rest[0], values=np.ones((len(more.rest), 1), np.float32), held=more.held)
    found = recording_of("slab", more, material, *rest[1:])
    assert found.boxes[..., 0].min() > speck[0] + body.spacing
    # Whoever reads it finds tissue in every box.
    write_recording(found, tmp_path)
    assert read_recording(tmp_path).body(body.spacing).held.any()


def test_a_clip_without_points_is_refused():
    with pytest.raises(Problem, match="no tracked point"):
        recording_of("slab", *clip(seen=False))
