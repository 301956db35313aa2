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


def carried(xy, seen, jaws, tip=None) -> np.ndarray:
    """Where a grip at (70, 50) is taken [px], (T, 2)."""
    flat = np.full((T, H, W), 0.1, np.float32)
    grip = Grip(np.array([70.0, 50.0]), 6.0, 3, T - 1, 1.0)
    paths = Paths(xy.astype(np.float32), seen, np.full(seen.shape, 0.1, np.float32))
    cam = camera(W, H, T)
    motion = carry([grip], paths, [jaws], [tip], Depth(flat, np.ones_like(flat), "known"), cam, "found")
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


def test_tissue_that_lags_behind_its_jaws_leaves_the_way_to_their_tip():
    _, _, xy, seen = pulled([Pull((127, 40), (70, 50), WAY, np.ones(T, bool))])
    lagging = (xy[:, :1] + 0.8 * (xy - xy[:, :1])).astype(float)
    rng = np.random.default_rng(0)
    tip = WAY + np.array([68, 47]) + rng.normal(0, 0.2, (T, 2))
    tip[:5] += np.arange(5, 0, -1)[:, None] * (4, 2)

    def off(tip) -> float:
        return np.linalg.norm((carried(lagging, np.ones_like(seen), None, tip) - WAY)[3:], axis=-1).max()

    assert off(tip) < 0.7 < 3 < off(None), "a tip that is on its own until it closes"
    assert off(np.array([68, 47]) - 0.5 * WAY[:, ::-1]) == off(None), "a tip that goes elsewhere"
    assert off(np.full((T, 2), np.nan)) == off(None), "a tip that is not seen"


def beside_an_edge(source: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of a grip at (70, 50) on a lobe at .06 m, whose jaws close on what lies behind it at .1 m and lift that by .02 m
    straight to the camera: its place at rest [px] and depth [m], and how its depth changes [m], (T,)."""
    x = np.arange(W)[None, None]
    z = np.broadcast_to(np.where(x < 75, 0.06, 0.1), (T, H, W)).astype(np.float32).copy()
    z[2:, :, 55:90] = 0.1
    z[:, :, 75:90] -= 0.02 * np.clip((np.arange(T) - 5) / 15, 0, 1)[:, None, None]
    z[2:, :, 55:75] = z[2:, :, 75:76]
    still = np.stack(np.meshgrid(np.arange(4.0, W, 6), np.arange(4.0, H, 6)), -1).reshape(-1, 1, 2).repeat(T, 1)
    paths = Paths(still.astype(np.float32), np.ones(still.shape[:2], bool), np.full(still.shape[:2], 0.1, np.float32))
    cam, grip = camera(W, H, T), Grip(np.array([70.0, 50.0]), 8.0, 3, T - 1, 1.0)
    motion = carry([grip], paths, [None], [None], Depth(z, np.ones_like(z), "known"), cam, source)
    return (
        cam.project(motion.center_rest)[0],
        motion.center_rest[0, 2],
        motion.position[0, :, 2] - motion.center_rest[0, 2],
    )


def test_beside_an_edge_of_depth_what_is_held_is_as_deep_as_the_jaws():
    place, z, way = beside_an_edge("found")
    assert place == pytest.approx([75, 50], abs=1)
    assert z == pytest.approx(0.1, abs=1e-3)
    assert way[-1] == pytest.approx(-0.02, abs=2e-3)
    assert (np.diff(way[3:]) < 1e-4).all()


def test_a_marked_place_is_taken_at_its_word():
    place, z, _ = beside_an_edge("given")
    assert place == pytest.approx([70, 50], abs=1e-6)
    assert z == pytest.approx(0.06, abs=1e-6)
