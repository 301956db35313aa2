"""What a new operation means, and what it refuses."""

import json

import numpy as np
import pytest
from slab import slab

from surgisim.artifacts.camera import Camera
from surgisim.problem import Problem
from surgisim.simulation.operation import plan, read_operation

CAMERA = Camera(80, 60, 90.0, 90.0, 39.5, 29.5, 25.0, 10, "known", "given", "slab", [80, 60], [0, 0, 80, 60])


def made(do, seconds=2.0):
    body = slab()
    return plan({"seconds": seconds, "do": do}, body.rest, body.surface, CAMERA, body.spacing)


PULL = {"act": "pull", "at": [39.5, 29.5], "by": [0.0, 0.0, -0.004], "begin": 0.2, "end": 0.8}


def test_a_pull_carries_the_place_it_took_and_holds_until_the_release():
    motion = made([PULL, {"act": "release", "time": 1.2}]).motion
    assert np.allclose(motion.center_rest[0], [0, 0, slab().rest[:, 2].min()], atol=1e-3)
    assert np.allclose(motion.position[0, -1] - motion.position[0, 0], [0, 0, -0.004])
    assert np.flatnonzero(motion.active[0]).tolist() == list(range(5, 31))


def test_a_shake_moves_the_base_and_grips_nothing():
    shaken = made([{"act": "shake", "by": [0.001, 0, 0], "frequency": 2.0, "begin": 0.0, "end": 1.0}])
    assert len(shaken.motion.radius) == 0
    assert np.abs(shaken.base[:26, 0]).max() > 0.0009
    assert not shaken.base[30:].any()


def test_a_cut_is_made_at_its_frame_from_the_surface_down():
    slit = made([{"act": "cut", "along": [[20, 30], [60, 30]], "depth": 0.005, "time": 0.4}])
    assert slit.cut_frame == 10
    top = slab().rest[:, 2].min()
    above, below = np.array([0.0, -0.002, top + 0.003]), np.array([0.0, 0.003, top + 0.003])
    deep = np.array([0.0, 0.0, 0.008])
    assert slit.cut.crosses(above, below)
    assert not slit.cut.crosses(above + deep, below + deep)
    assert not slit.cut.crosses(above, above + np.array([0.004, 0, 0]))


@pytest.mark.parametrize(
    ("do", "said"),
    [
        ([{**PULL, "at": [400, 30]}], "meets no tissue"),
        ([{**PULL, "end": 5.0}], "within the 2.0 s"),
        ([{**PULL, "begin": 1.0, "end": 0.5}], "must end after it begins"),
        ([{**PULL, "radus": 0.1}], "did you mean 'radius'"),
        ([{"act": "tear"}], "tear"),
        ([{"act": "cut", "along": [[20, 30], [60, 30]], "depth": 0.005}] * 2, "one can be made"),
        ([{"act": "cut", "along": [[20, 30], [21, 30]], "depth": 0.005}], "Make the cut longer"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_sentence(do, said):
    with pytest.raises(Problem, match=said):
        made(do)


def test_a_file_that_is_no_operation_is_named(tmp_path):
    path = tmp_path / "pull.json"
    with pytest.raises(Problem, match="no such file"):
        read_operation(path)
    path.write_text("{")
    with pytest.raises(Problem, match="is not JSON"):
        read_operation(path)
    path.write_text(json.dumps([1]))
    with pytest.raises(Problem, match="holds a list"):
        read_operation(path)
