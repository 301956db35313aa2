"""forces.npz of a recording folder."""

from dataclasses import replace

import numpy as np
import pytest

from surgisim.problem import Problem
from surgisim.recordings.forces import Forces, encoded_forces, read_forces

FRAMES = 6


def told(**more):
    force = np.full((2, FRAMES, 3), np.nan)
    force[0, 2:4] = [0.0, 0.1, 0.3]
    return {"force": force, "sigma": np.array([0.01, 0.02])} | more


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"force": np.zeros((1, FRAMES, 3)), "sigma": np.ones(1)}, "of 1 grips, but grip.npz has 2"),
        ({"force": np.zeros((2, FRAMES + 1, 3))}, "is wanted, with"),
        ({"sigma": np.array([0.0, 0.1])}, "noise of 'force'"),
        ({"force": np.full((2, FRAMES, 3), 5e3)}, "Is it in another unit"),
        ({"force": np.full((2, FRAMES, 3), np.nan)}, "no force is a number"),
        ({"held": np.zeros((1, FRAMES, 3))}, "Give both, or neither"),
    ],
)
def test_forces_that_could_be_misread_are_refused(tmp_path, more, said):
    np.savez(tmp_path / "forces.npz", **told(**more))
    with pytest.raises(Problem, match=said):
        read_forces(tmp_path / "forces.npz", FRAMES, 2)


def test_no_file_is_no_forces(tmp_path):
    assert read_forces(tmp_path / "forces.npz", FRAMES, 2) is None


def test_forces_are_of_what_is_held_and_then_of_the_grips(tmp_path):
    held = np.full((1, FRAMES, 3), 0.2)
    np.savez(tmp_path / "forces.npz", **told(held=held, held_sigma=np.array([0.03])))
    found = read_forces(tmp_path / "forces.npz", FRAMES, 2)
    force, sigma = found.of_anchors(FRAMES)
    assert force.shape == (3, FRAMES, 3)
    assert sigma.tolist() == [0.03, 0.01, 0.02]
    np.testing.assert_array_equal(force[0], held[0])
    bare, _ = replace(found, held=np.zeros((0, 0, 3)), held_sigma=np.zeros(0)).of_anchors(FRAMES)
    assert np.isnan(bare[0]).all()


def test_forces_of_other_shapes_are_no_forces():
    with pytest.raises(Problem, match="are wanted"):
        Forces(np.zeros((2, FRAMES, 3)), np.ones(1))


def test_what_is_written_is_read_again(tmp_path):
    made = Forces(told()["force"], told()["sigma"], np.full((1, FRAMES, 3), 0.2), np.array([0.03]))
    np.savez(tmp_path / "forces.npz", **encoded_forces(made))
    again = read_forces(tmp_path / "forces.npz", FRAMES, 2)
    for name, value in vars(made).items():
        np.testing.assert_array_equal(getattr(again, name), value)
