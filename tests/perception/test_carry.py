"""A held ball goes where its tissue goes, and with the jaws where that is lost."""

import numpy as np
import pytest
from pulled_points import H, Pull, W, course, pulled
from pulled_sheet import camera

from surgisim.artifacts.depth import Depth
from surgisim.perception.grasp.carry import carry
from surgisim.perception.grasp.find import Grip
from surgisim.perception.tracking import Paths

T = 30
WAY = course(T, 5, 25, (24, 6))


def carried(xy, seen, jaws) -> np.ndarray:
    """Where a grip at (70, 50) is taken [px], (T, 2)."""
    flat = np.full((T, H, W), 0.1, np.float32)
    grip = Grip(np.array([70.0, 50.0]), 6.0, 3, T - 1, 1.0)
    paths = Paths(xy.astype(np.float32), seen, np.full(seen.shape, 0.1, np.float32))
    cam = camera(W, H, T)
    motion = carry([grip], paths, [jaws], Depth(flat, np.ones_like(flat), "known"), cam, "found")
    return cam.project(motion.position[0]) - (70, 50)


def steps() -> np.ndarray:
    return np.diff(WAY, axis=0, append=WAY[-1:])


@pytest.mark.parametrize("lost", ["hidden", "left behind", "not at all"])
def test_the_ball_goes_with_the_jaws(lost):
    _, _, xy, seen = pulled([Pull((127, 40), (70, 50), WAY, np.ones(T, bool))])
    seen = np.ones_like(seen)
    if lost == "hidden":
        seen[:, 8:] = False
    if lost == "left behind":
        xy = xy[:, :1].repeat(T, axis=1)
    assert np.linalg.norm(carried(xy, seen, steps())[-1] - WAY[-1]) < 4


def test_tissue_that_is_seen_corrects_jaws_whose_motion_is_measured_a_little_short():
    _, _, xy, seen = pulled([Pull((127, 40), (70, 50), WAY, np.ones(T, bool))])
    assert np.linalg.norm(carried(xy, np.ones_like(seen), 0.85 * steps())[-1] - WAY[-1]) < 3


def test_the_course_of_a_way_is_that_of_the_tissue_around():
    _, _, xy, seen = pulled([Pull((127, 40), (70, 50), WAY, np.ones(T, bool))])
    ring = np.linalg.norm(xy[:, 0] - (70, 50), axis=-1) <= 6
    xy = xy.copy()
    xy[ring, 3:] += np.random.default_rng(0).normal(0, 1.5, (T - 3, 2))
    way = carried(xy, np.ones_like(seen), None)
    share = way @ WAY[-1] / np.linalg.norm(WAY[-1]) / np.linalg.norm(way[-1])
    truth = WAY @ WAY[-1] / np.linalg.norm(WAY[-1]) ** 2
    assert np.sqrt(((share - truth) ** 2).mean()) < 0.02
