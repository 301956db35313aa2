"""Depth's change of pulled tissue, on soft layers whose pull is planted."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from pulled_sheet import camera

from surgisim.lighting.headlight import log_brightness_change
from surgisim.perception.depth.pull import Watched, _shared, nearer
from surgisim.perception.depth.shading import Lattice
from surgisim.perception.depth.soft_layer import SoftLayer

COURSE = np.array([0.0, 0.0, 0.3, 0.7, 1.0, 1.0, 0.1])
"""Share of the pull in every frame."""
SLOPE = np.array([0.1, -0.3])
CENTER = np.array([0.05, -0.03, 1 + SLOPE @ [0.05, -0.03]])
_OUT = np.array([*SLOPE, -1.0]) / np.sqrt(1 + SLOPE @ SLOPE)
_RIGHT = np.array([1.0, 0.0, SLOPE[0]]) / np.hypot(1, SLOPE[0])
AXES = np.stack([_RIGHT, np.cross(_OUT, _RIGHT), _OUT])
"""Of the slanted layer: twice along it, and out of it."""


@pytest.fixture(scope="module")
def layer() -> SoftLayer:
    return SoftLayer.solved()


@pytest.fixture(scope="module")
def lattice() -> Lattice:
    return Lattice.of(camera(64, 48, len(COURSE)), 1.0)


def test_held_tissue_goes_where_it_is_carried(layer):
    inside = np.array([[0.0, 0.0], [0.5, 0.5], [-0.75, 0.0]])
    assert np.allclose(layer.carried(inside, 2.0), np.eye(3), atol=1e-5)


def test_a_pull_reaches_farther_along_the_layer_than_out_of_it(layer):
    along, _, out = np.einsum("kii->ik", layer.carried(np.array([[2.0, 0.0], [4.0, 0.0]]), 2.0))
    assert 0.2 < along[0] < 0.7 > 2 * out[0]
    assert np.abs([along[1], out[1]]).max() < 0.15


def test_tissue_bulges_before_a_pull_and_sinks_behind_it(layer):
    before, behind = layer.carried(np.array([[1.75, 0.0], [-1.75, 0.0]]), 2.0)[:, 2, 0]
    assert before > 0.05
    assert np.isclose(before, -behind, atol=0.01)


def test_a_layer_moves_the_same_whichever_way_it_lies(layer):
    at = np.array([[1.5, 0.5]])
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = layer.carried(at @ turn[:2, :2].T, 3.0)[0]
    assert np.allclose(turned, turn @ layer.carried(at, 3.0)[0] @ turn.T, atol=1e-4)


@pytest.mark.parametrize("pull", [(0.09, -0.03, 0.06), (-0.06, 0.02, 0.10), (0.0, 0.08, 0.01)])
def test_a_planted_pull_is_found_along_the_view(lattice, layer, pull):
    rest, watched, change = _pulled(lattice, layer, np.array(pull))
    found = nearer(lattice, rest, watched)[0]
    assert np.sqrt(((found - change) ** 2).sum() / (change**2).sum()) < 0.15


def test_where_light_tells_little_the_instrument_tells_how_far_tissue_comes_nearer(lattice, layer):
    pull = np.array([0.09, -0.03, 0.06])
    rest, watched, change = _pulled(lattice, layer, pull)
    smoky = replace(watched, light=watched.light + _smoke(watched))

    def off(*tools: _Tip) -> float:
        return np.sqrt(((nearer(lattice, rest, smoky, tools)[0] - change) ** 2).sum() / (change**2).sum())

    tip, alone = _Tip.of(pull), off()
    away = replace(tip, way=tip.way + np.array([0.5, 0.0, 0.0]))
    assert off(tip) < 0.5 * alone
    assert off(away) == alone, "an instrument elsewhere holds nothing here"
    assert off(replace(tip, unsure=1.0)) > 1.5 * off(tip), "stretches that contradict each other say little"


def test_light_that_changes_where_nothing_moves_counts_for_less(lattice, layer, monkeypatch):
    rest, watched, change = _pulled(lattice, layer, np.array([0.09, -0.03, 0.06]))
    smoky = replace(watched, light=watched.light + _smoke(watched))

    def off() -> float:
        return np.sqrt(((nearer(lattice, rest, smoky)[0] - change) ** 2).sum() / (change**2).sum())

    counted = off()
    monkeypatch.setattr("surgisim.perception.depth.pull._restless", lambda brighter, still: np.zeros(len(brighter)))
    assert counted < 0.4 < 0.6 < off()


def test_where_nothing_moves_nothing_comes_nearer(lattice, layer):
    rest, watched, _ = _pulled(lattice, layer, np.zeros(3))
    assert not nearer(lattice, rest, watched)[0].any()


def test_a_view_that_slides_as_a_whole_brings_nothing_nearer(lattice, layer):
    rest, watched, _ = _pulled(lattice, layer, np.zeros(3))
    slid = watched.ray + 0.1 * COURSE[:, None, None]
    assert np.abs(nearer(lattice, rest, Watched(slid, watched.sure, watched.light, watched.lit))[0]).max() < 0.02


def test_a_pulled_layer_explains_its_motion_and_stripes_that_go_to_and_fro_are_none(lattice, layer):
    rest, watched, _ = _pulled(lattice, layer, np.array([0.09, -0.03, 0.06]))
    assert nearer(lattice, rest, watched)[2][COURSE > 0].min() > 0.8
    # Stripes that go to and fro, as no held ball carries its surroundings.
    fold = 0.05 * np.sin(25 * watched.ray[0, :, :1]) * [0.0, 1.0]
    folded = Watched(watched.ray[0] + COURSE[:, None, None] * fold, watched.sure, watched.light, watched.lit)
    assert nearer(lattice, rest, folded)[2][COURSE > 0.5].max() < 0.3


def test_what_goes_farthest_is_the_whole_course_though_more_frames_go_a_little_the_other_way():
    course = np.array([0.0, *[-0.4] * 12, 1.0])
    pattern = np.random.default_rng(0).standard_normal((30, 2))
    found, share, _ = _shared(course[:, None, None] * pattern, np.ones((len(course), 30)))
    assert share == pytest.approx(course, abs=1e-3)
    assert found == pytest.approx(pattern, abs=1e-2)


def _smoke(watched: Watched) -> np.ndarray:
    """Changes of log brightness that drift, (T, K)."""
    time = np.arange(len(COURSE))[:, None]
    return 0.3 * np.sin(9 * watched.ray[0, :, 0] + 6 * watched.ray[0, :, 1] + 0.9 * time)


@dataclass(frozen=True)
class _Tip:
    """Goes as an outline's tip does."""

    way: np.ndarray
    """X and Y of (X, Y, 1) and the logarithm of its distance, (T, 3)."""
    unsure: float = 0.0
    """How far the outline's stretches contradict each other."""

    @classmethod
    def of(cls, pull: np.ndarray) -> "_Tip":
        moved = CENTER + COURSE[:, None] * (AXES.T @ pull)
        return cls(np.concatenate([moved[:, :2] / moved[:, 2:], np.log(moved[:, 2:] / CENTER[2])], 1))

    def ray(self, frames: np.ndarray) -> np.ndarray:
        return self.way[frames, :2]

    def carried(self, frames: np.ndarray, reference: int) -> np.ndarray:
        grown = self.way[frames, 2:] - self.way[reference, 2]
        apart = self.unsure * COURSE[frames, None] * [-1.5, -0.5, 0.5, 1.5]
        return np.concatenate([self.way[frames, :2], grown, grown + apart], 1)


def _pulled(lattice: Lattice, layer: SoftLayer, pull: np.ndarray) -> tuple[np.ndarray, Watched, np.ndarray]:
    """Log depth at rest, what is seen of a slanted layer, and how its log depth changes, (T, h, w).

    pull: along the layer twice and out of it, over the distance.
    """
    ray = np.concatenate([lattice.ray.reshape(-1, 2), np.ones((lattice.pixels[..., 0].size, 1))], -1)
    tissue = ray / (ray @ [-SLOPE[0], -SLOPE[1], 1.0])[:, None]
    at = (tissue - CENTER) @ AXES[:2].T / 0.06
    unit = AXES.T @ layer.carried(at, 2.5)
    moved = tissue + np.einsum("t,kij,j->tki", COURSE, unit, pull)
    rng = np.random.default_rng(0)
    normals = [_normals(points, lattice.shape) for points in (tissue, *moved)]
    light = [
        log_brightness_change(tissue, normals[0], points, normal, ambient=0.05)
        for points, normal in zip(moved, normals[1:], strict=True)
    ]
    seen = moved[..., :2] / moved[..., 2:] + 2e-4 * rng.standard_normal((*moved.shape[:2], 2))
    light = np.stack(light) + 0.02 * rng.standard_normal(moved.shape[:2])
    known = np.ones(moved.shape[:2])
    shape = len(COURSE), *lattice.shape
    rest = np.log(tissue[:, 2])
    return (
        rest.reshape(lattice.shape),
        Watched(seen, known, light, known),
        (np.log(moved[..., 2]) - rest).reshape(shape),
    )


def _normals(points: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Toward the camera, of a grid of points (K, 3)."""
    grid = points.reshape(*shape, 3)
    return np.cross(np.gradient(grid, axis=0), np.gradient(grid, axis=1)).reshape(-1, 3)
