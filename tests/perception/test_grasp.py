import numpy as np
import pytest
from pulled_sheet import pull_sheet

from surgisim.artifacts.depth import Depth
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.motion import Motion
from surgisim.config.base import parse
from surgisim.config.correspondence import Correspondence
from surgisim.config.tracking import Tracking
from surgisim.perception.grasp.contact import distance, frame_flow
from surgisim.perception.grasp.following import jaw_motion
from surgisim.perception.grasp.instruments import instruments
from surgisim.perception.tracking.correspond import correspond
from surgisim.perception.tracking.follow import follow
from surgisim.problem import Problem

BEGIN, RELEASE = 4, 14


@pytest.fixture(scope="module")
def sheet():
    return pull_sheet(frames=20, begin=BEGIN, release=RELEASE)


@pytest.fixture(scope="module")
def motion(sheet) -> Motion:
    return _motion(sheet)


def test_the_one_grasp_is_found_where_and_when_it_is(sheet, motion):
    assert motion.source == "found"
    assert motion.active.shape[0] == 1
    assert np.linalg.norm(motion.center_rest[0] - sheet.grip[0]) < 0.003
    assert 0.5 < motion.radius[0] / sheet.radius < 1.6
    held = np.flatnonzero(motion.active[0])
    assert abs(held[0] - BEGIN) <= 2
    assert abs(held[-1] - (RELEASE - 1)) <= 2


def test_its_way_is_the_instruments_way(sheet, motion):
    held = slice(BEGIN, RELEASE - 1)
    way, true = motion.position[0] - motion.center_rest[0], sheet.grip - sheet.grip[0]
    assert np.linalg.norm(way - true, axis=-1)[held].max() < 0.0015
    assert np.allclose(way[0], 0)


def test_after_the_release_the_position_rests(motion):
    last = np.flatnonzero(motion.active[0])[-1]
    assert np.allclose(motion.position[0, last:], motion.position[0, last])


def test_an_instrument_that_only_passes_holds_nothing(capsys):
    passing = pull_sheet(frames=16, begin=4, release=12, pull=(0.0, 0.0, 0.0))
    motion = _motion(passing)
    assert motion.source == "none"
    assert motion.position.shape == (0, 16, 3)
    assert "no grasp" in capsys.readouterr().err


def test_without_an_instrument_there_is_no_grasp(sheet):
    motion = _motion(sheet, tool=np.zeros_like(sheet.tool))
    assert motion.source == "none"


def test_a_given_grasp_is_taken_as_given(sheet):
    x, y = sheet.camera.project(sheet.grip[0])
    settings = {"grasp": [{"pixel": [x, y], "radius": 5.0, "start": 0.16, "end": 0.52}]}
    motion = _motion(sheet, settings)
    assert motion.source == "given"
    assert np.flatnonzero(motion.active[0]).tolist() == list(range(4, 14))
    assert np.linalg.norm(motion.center_rest[0] - sheet.grip[0]) < 0.001
    assert np.linalg.norm(motion.position[0, 12] - sheet.grip[12]) < 0.002


@pytest.mark.parametrize(
    ("grasp", "word"),
    [
        ({"pixel": [500.0, 10.0], "radius": 5.0}, "outside the picture"),
        ({"pixel": [20.0, 4.0], "radius": 5.0}, "not on the tissue"),
        ({"pixel": [60.0, 50.0], "radius": 5.0, "start": 0.5, "end": 0.2}, "END must be later"),
        ({"pixel": [60.0, 50.0], "radius": 5.0, "start": 5.0, "end": 6.0}, "lasts from"),
    ],
)
def test_a_grasp_that_cannot_be_is_refused_in_a_sentence(sheet, grasp, word):
    tissue = ~sheet.tool
    tissue[:, :10] = False
    with pytest.raises(Problem, match=word):
        _motion(sheet, {"grasp": [grasp]}, tissue=tissue)


def test_the_jaws_own_motion_is_measured_on_them(sheet):
    flow = frame_flow(sheet.rgb)
    (tool,) = instruments(sheet.tool, np.ones(sheet.tool.shape[1:], bool), flow)
    step = np.diff(sheet.camera.project(sheet.grip), axis=0)[7]
    assert np.linalg.norm(jaw_motion(flow, tool, 128)[7] - step) < 0.35 * np.linalg.norm(step)


def test_distance_to_an_instrument_is_none_behind_it(sheet):
    tip = sheet.camera.project(sheet.grip)[None]
    assert distance(sheet.tool, tip.astype(np.float32))[0, 7] == 0


def _motion(sheet, settings=None, *, tool=None, tissue=None) -> Motion:
    tool = sheet.tool if tool is None else tool
    masks = Masks(tool, ~tool if tissue is None else tissue & ~tool, np.zeros_like(tool), np.ones(len(tool)))
    depth = Depth(sheet.depth.astype(np.float32), np.ones(sheet.depth.shape, np.float32), "known")
    frames = Frames(sheet.rgb, np.zeros(len(sheet.rgb), np.uint8))
    surface = correspond(frames, masks, Correspondence())
    return follow(frames, masks, surface, depth, sheet.camera, parse(Tracking, settings or {}, "tracking"))[1]
