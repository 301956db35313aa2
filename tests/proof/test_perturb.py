"""What each perturbation changes, and that it changes nothing else."""

import dataclasses

import numpy as np
import pytest
from made_up import paths, recording

from surgisim.problem import Problem
from surgisim.proof.perturb.catalogue import PERTURBED, perturbed
from surgisim.proof.perturb.names import KEYED, KEYLESS
from surgisim.recordings.folder import read_recording, write_recording
from surgisim.recordings.mesh import Mesh, closed
from surgisim.recordings.recording import Recording

BODY = recording()
# A plate of 3 mm under the box of tissue, as the phantom's.
PLATE = 3e-3


def on_plate() -> Recording:
    """Tissue from z = 0 to 20 mm on a plate from -3 mm, a column of vertices at the base's rim."""
    top, base = BODY.mesh.vertices.copy(), BODY.mesh.vertices.copy()
    base[:, 2] = np.where(base[:, 2] > 0.01, 0.0, -PLATE)
    faces = BODY.mesh.faces
    under, over = ({tuple(f) for f in faces[(m[faces, 2] == e).all(1)]} for m, e in ((top, 0.0), (base, 0.0)))
    both = [f for f in faces if tuple(f) not in under], [f for f in faces if tuple(f) not in over]
    mesh = closed(Mesh(np.concatenate([top, base]), np.concatenate([both[0], np.array(both[1]) + len(top)])), "made up")
    boxes = np.array([[[-0.01, -0.01, -0.0045], [0.07, 0.05, 0.0]]])
    return dataclasses.replace(BODY, mesh=mesh, boxes=boxes, gravity=(0.0, 0.0, -9.81))


MADE = on_plate()
TRUE = paths()
CHANGES = {
    "release+1": {"active"},
    "release-1": {"active"},
    "noplate": {"mesh", "boxes"},
    "box3": {"mesh", "boxes"},
    "box0.3": {"mesh", "boxes"},
    "plane+3": {"boxes"},
    "plane-3": {"boxes"},
    "noplate_plane+3": {"mesh", "boxes"},
    **{key: {"points"} for key in ("drift0.3", "drift1", "bilinear1", "jitter0.1", "jitter0.3", "new_noise")},
    **{key: {"mesh", "boxes", "points", "center_rest", "position"} for key in ("focal+10", "focal-10")},
    **{key: {"points", "visible"} for key in ("missing2", "missing5", "missing20")},
    "half_frames": {"fps", "points", "visible", "position", "active", "split"},
    "half_points": {"points", "visible", "sigma"},
    **{key: {"points", "sigma"} for key in ("noise2", "noise1.1")},
    "rotated": {"mesh", "boxes", "points", "center_rest", "position", "gravity"},
}


def parts(one: Recording) -> dict:
    motion = one.motion
    return {
        "mesh": one.mesh.vertices, "faces": one.mesh.faces.shape, "boxes": one.boxes, "points": one.points,
        "visible": one.visible, "sigma": one.sigma, "fps": one.fps, "split": one.split, "gravity": one.gravity,
        "density": one.density, "name": one.name, "tier": one.tier, "starts": one.starts, "place": one.place,
        "active": motion.active, "position": motion.position, "center_rest": motion.center_rest,
        "radius": motion.radius,
    }  # fmt: skip


def changed(before: Recording, after: Recording) -> set[str]:
    def same(a, b) -> bool:
        if isinstance(a, np.ndarray):
            return a.shape == b.shape and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
        return a == b

    old, new = parts(before), parts(after)
    return {name for name in old if not same(old[name], new[name])} - {"faces"}


def away(name: str) -> np.ndarray:
    """How far each sample moved [m], (K, T), NaN where unseen."""
    return np.linalg.norm(perturbed(name, MADE, 1, TRUE).points - MADE.points, axis=-1)


def test_every_perturbation_is_tried_here():
    assert CHANGES.keys() == PERTURBED.keys()
    assert {*KEYED, *KEYLESS} == PERTURBED.keys()


@pytest.mark.parametrize("name", PERTURBED)
def test_what_must_change_changes_and_nothing_else(name, tmp_path):
    made = perturbed(name, MADE, 1, TRUE)
    assert changed(MADE, made) == CHANGES[name]
    assert not changed(made, perturbed(name, MADE, 1, TRUE))
    write_recording(made, tmp_path)
    assert read_recording(tmp_path).frames == made.frames
    # Whatever holds, something is held and something is free.
    assert 0 < made.body(3e-3).held.mean() < 1


def test_a_grip_holds_a_frame_longer_or_shorter_and_begins_as_before():
    for name, by in (("release+1", 1), ("release-1", -1)):
        active = perturbed(name, MADE, 1).motion.active
        for old, new in zip(MADE.motion.active, active, strict=True):
            assert np.flatnonzero(new)[0] == np.flatnonzero(old)[0]
            assert np.flatnonzero(new)[-1] == np.flatnonzero(old)[-1] + by
    near = MADE.motion.active.copy()
    near[0, 16:20] = True
    motion = dataclasses.replace(MADE.motion, active=near)
    runs = perturbed("release+1", dataclasses.replace(MADE, motion=motion), 1).motion.active[0]
    assert not runs[15]
    assert runs[20]


def test_without_its_plate_the_body_is_the_tissue_and_nothing_is_left_below():
    bare = perturbed("noplate", MADE, 1)
    assert bare.mesh.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-12)
    assert bare.mesh.volume == pytest.approx(BODY.mesh.volume, rel=1e-9)
    assert MADE.mesh.volume == pytest.approx(BODY.mesh.volume * 23 / 20, rel=1e-9)
    assert bare.boxes[0, :, 2] == pytest.approx([-1.5e-4, 1.5e-4])
    with pytest.raises(Problem, match="no mounting plate"):
        perturbed("noplate", BODY, 1)


def test_the_held_plane_is_stated_elsewhere():
    ends = {name: perturbed(name, MADE, 1).boxes[0, :, 2].tolist() for name in PERTURBED if "plane" in name}
    assert ends["plane+3"] == pytest.approx([-4.5e-3, 3e-3])
    assert ends["plane-3"] == pytest.approx([-4.5e-3, -3e-3])
    assert ends["noplate_plane+3"] == pytest.approx([2.85e-3, 3.15e-3])
    for name, depth in (("box3", 3e-3), ("box0.3", 3e-4)):
        assert perturbed(name, MADE, 1).boxes[0, 1, 2] == pytest.approx(depth)
        # Of a recording without a plate too, whatever it held before.
        assert perturbed(name, BODY, 1).boxes[0, 1, 2] == pytest.approx(depth)


def test_a_drift_is_as_large_as_said_begins_at_nothing_and_is_slow():
    for name, size in (("drift0.3", 3e-4), ("drift1", 1e-3), ("bilinear1", 1e-3)):
        far = away(name)
        assert np.nanmax(far) == pytest.approx(size, rel=0.1)
        assert np.nanmax(far[:, 0]) < 1e-8
        assert np.nanmax(np.abs(np.diff(far, axis=1))) < 0.25 * size


def test_a_rigid_drift_keeps_distances_and_a_bilinear_one_does_not():
    def stretch(name):
        made = perturbed(name, MADE, 1)
        old, new = (np.linalg.norm(p[:, None] - p[None], axis=-1) for p in (MADE.points, made.points))
        return np.nanmax(np.abs(new - old))

    assert stretch("drift1") < 1e-7 < 0.2e-3 < stretch("bilinear1")


def test_jitter_has_its_size_in_every_frame():
    for name, size in (("jitter0.1", 1e-4), ("jitter0.3", 3e-4)):
        off = (perturbed(name, MADE, 1).points - MADE.points).astype(float)
        shift = np.nanmean(off, 0)
        assert shift.std() == pytest.approx(size, rel=0.25)
        assert np.abs(np.corrcoef(shift[1:].ravel(), shift[:-1].ravel())[0, 1]) < 0.3


def test_another_focal_length_stretches_sideways_and_not_in_depth():
    made = perturbed("focal+10", MADE, 1)
    for old, new in ((MADE.mesh.vertices, made.mesh.vertices), (MADE.motion.position, made.motion.position)):
        assert new == pytest.approx(old * [1.1, 1.1, 1.0])
    assert np.ptp(perturbed("focal-10", MADE, 1).boxes[..., 0]) == pytest.approx(0.9 * np.ptp(MADE.boxes[..., 0]))


def test_as_many_samples_are_lost_as_said_half_of_them_in_runs():
    count = MADE.visible[:, 1:].sum()
    for name, share in (("missing2", 0.02), ("missing5", 0.05), ("missing20", 0.2)):
        made = perturbed(name, MADE, 1)
        assert made.visible[:, 0].all()
        assert not (made.visible & ~MADE.visible).any()
        assert (MADE.visible & ~made.visible).sum() == round(share * count)
        assert np.isnan(made.points[~made.visible]).all()
    many = dataclasses.replace(MADE, **{k: np.repeat(getattr(MADE, k), 20, 0) for k in ("points", "visible", "sigma")})
    lost = many.visible & ~perturbed("missing5", many, 1).visible
    beside = lost[:, 1:] & lost[:, :-1]
    assert 0.3 < (beside.sum() / lost.sum()) < 0.6


def test_every_second_frame_keeps_times_and_the_split():
    made = perturbed("half_frames", MADE, 1)
    assert (made.frames, made.fps) == (20, 5.0)
    assert made.split == {"fit": (0, 12), "held_out": (12, 20)}
    begins = [np.flatnonzero(a)[0] / r.fps for r in (MADE, made) for a in r.motion.active]
    assert np.abs(np.subtract(begins[:2], begins[2:])).max() <= 1 / MADE.fps + 1e-9


def test_noise_is_twice_as_large_with_the_true_paths_and_without():
    for true in (TRUE, None):
        made = perturbed("noise2", MADE, 1, true)
        off = made.points - TRUE
        assert np.nanstd(off) == pytest.approx(2 * np.nanstd(MADE.points - TRUE), rel=0.1)
        assert made.sigma == pytest.approx(2 * MADE.sigma)


def test_new_noise_is_as_large_and_another():
    made = perturbed("new_noise", MADE, 1, TRUE)
    old, new = (r.points[r.visible] - TRUE[r.visible] for r in (MADE, made))
    assert new.std() == pytest.approx(old.std(), rel=0.5)
    assert abs(np.corrcoef(old.ravel(), new.ravel())[0, 1]) < 0.2
    with pytest.raises(Problem, match="true paths"):
        perturbed("new_noise", MADE, 1)


def test_a_turned_recording_has_the_same_distances_holds_the_same_and_falls_the_same_way():
    for seed in range(6):
        made = perturbed("rotated", MADE, seed)
        old, new = (np.linalg.norm(r.points[:, None, 5] - r.points[None, :, 5], axis=-1) for r in (MADE, made))
        assert np.nanmax(np.abs(new - old)) < 1e-7
        assert made.mesh.volume == pytest.approx(MADE.mesh.volume)
        # The height over the held plane, along gravity, is as before.
        down = np.array(made.gravity) / 9.81
        assert np.linalg.norm(down) == pytest.approx(1.0)
        corners = made.boxes[0][:, np.abs(down).argmax()] * down[np.abs(down).argmax()]
        held = (-made.points[:, 0] @ down) + corners.min()
        assert held == pytest.approx(MADE.points[:, 0, 2], abs=1e-6)
        assert made.body(3e-3).held.mean() == pytest.approx(MADE.body(3e-3).held.mean(), abs=0.03)


def test_what_is_not_known_is_said():
    with pytest.raises(Problem, match="is not known here"):
        perturbed("upside_down", MADE, 1)
