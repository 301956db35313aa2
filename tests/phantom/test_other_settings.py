"""What the settings of the generator change that are not a seed's choice, and that they change nothing else."""

import dataclasses
import io
import json

import numpy as np
import pytest
from concealed_pieces import SPACING, block

from surgisim.config.invent import Invent
from surgisim.phantom.blind import invent
from surgisim.phantom.follow import _held, follow
from surgisim.phantom.model import model
from surgisim.recordings.folder import read_recording

QUICK = Invent(seed=4, case=3, points=40, spacing=5.5e-3, spacing_coarse=6.5e-3)


def made(**settings):
    return invent(QUICK.model_copy(update=settings), names=())


def paths(one) -> np.ndarray:
    return np.load(io.BytesIO(one.tracks))["true"]


@pytest.fixture(scope="module")
def plain():
    return made()


def test_grips_hold_whole_frames_unless_told_otherwise():
    for hold in block().holds:
        for frame in range(1, block().frames):
            first, end = _held(hold, frame, 40)
            assert (first, end) == (0, 40) if hold.begin < frame <= hold.release else first >= end
    hold = dataclasses.replace(hold, close_phase=0.25, release_phase=0.5)
    assert _held(hold, hold.begin, 40) == (30, 40)
    assert _held(hold, hold.begin - 1, 40) == (40, 40)
    assert _held(hold, hold.release + 1, 40) == (0, 20)
    assert _held(hold, hold.release + 2, 40) == (0, 0)


def test_a_grip_that_opens_later_keeps_what_was_before_and_lets_go_later():
    scene = block()
    on, late = (follow(model(s, SPACING)) for s in (scene, scene.between_frames(0.0, 0.5)))
    release = scene.holds[0].release
    assert (on[:, : release + 1] == late[:, : release + 1]).all()
    gone = [np.linalg.norm(p[:, release + 1] - p[:, release], axis=-1).max() for p in (on, late)]
    assert 0 < gone[1] < gone[0]


def test_a_grip_that_closes_earlier_finds_resting_tissue_where_it_was():
    scene = block()
    on, early = (follow(model(s, SPACING)) for s in (scene, scene.between_frames(0.5, 0.0)))
    first = slice(0, scene.holds[1].begin - 1)
    assert early[:, first] == pytest.approx(on[:, first], abs=1e-9)


def test_only_paths_and_truth_differ_between_frames(plain):
    between = made(close_phase=0.5, release_phase=0.5)
    same = {name for name in plain.recording if plain.recording[name] == between.recording[name]}
    assert same == plain.recording.keys() - {"tracks.npz"}
    assert json.loads(between.truth)["phases"][0]["release_phase"] == 0.5
    assert "release_phase" not in json.loads(plain.truth)["phases"][0]


def test_quick_tissue_is_the_same_tissue_with_less_viscosity(plain):
    quick = made(lag=3e-4)
    old, new = (json.loads(one.truth)["base"] for one in (plain, quick))
    assert new["eta"] == pytest.approx(3e-4 * new["E"])
    assert {k: v for k, v in old.items() if k != "eta"} == {k: v for k, v in new.items() if k != "eta"}
    assert {n for n in plain.recording if plain.recording[n] == quick.recording[n]} >= {"rest.ply", "fixed.json"}
    assert not (paths(plain) == paths(quick)).all()


def test_without_its_plate_the_body_is_the_tissue_alone_and_moves_the_same(plain, tmp_path):
    bare = made(plate=False)
    changed = {name for name in plain.recording if plain.recording[name] != bare.recording[name]}
    assert changed == {"rest.ply", "fixed.json"}
    assert bare.tracks == plain.tracks
    read = []
    for name, one in (("plain", plain), ("bare", bare)):
        (tmp_path / name).mkdir()
        for file, raw in one.recording.items():
            (tmp_path / name / file).write_bytes(raw)
        read.append(read_recording(tmp_path / name))
    floor = [r.mesh.vertices[:, 2].min() for r in read]
    assert floor[1] - floor[0] == pytest.approx(3e-3)
    assert np.diff(read[1].boxes[0, :, 2]) == pytest.approx(3e-4)
    assert read[1].boxes[0, :, 2].mean() == pytest.approx(floor[1])
    # Taking the plate off a recording gives the same body.
    from surgisim.proof.perturb.catalogue import perturbed

    taken_off = perturbed("noplate", read[0], 0)
    assert taken_off.mesh.volume == pytest.approx(read[1].mesh.volume, rel=1e-9)
    assert taken_off.boxes == pytest.approx(read[1].boxes, abs=1e-9)
