from types import SimpleNamespace

import numpy as np
import pytest
from pulled_sheet import pull_sheet

from surgisim.artifacts.depth import Depth
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.config.correspondence import Correspondence
from surgisim.config.tracking import Tracking
from surgisim.perception.tracking import cotracker, flow_chain
from surgisim.perception.tracking.correspond import between, correspond
from surgisim.perception.tracking.follow import follow
from surgisim.perception.tracking.points import spread_points
from surgisim.perception.tracking.refine import Found, find, templates
from surgisim.perception.tracking.spread import spread
from surgisim.problem import Problem


@pytest.fixture(scope="module")
def sheet():
    return pull_sheet(frames=18, begin=4, release=12)


@pytest.fixture(scope="module")
def tracked(sheet):
    queries = spread_points(np.ones_like(sheet.tool[0]), 300)
    frames, masks, surface, *_ = _stage(sheet)
    paths = flow_chain.track(frames.rgb, surface, masks.specular, queries, settings=Tracking())
    near = np.rint(queries).astype(int)
    # Between pixels the sheet's own motion is nearly linear.
    true = queries[:, None] + (sheet.position - sheet.position[0])[:, near[:, 1], near[:, 0]].swapaxes(0, 1)
    return paths, true, _shown(sheet, true)


def test_points_are_followed_to_a_tenth_of_a_pixel(tracked):
    paths, true, shown = tracked
    error = np.linalg.norm(paths.xy - true, axis=-1)
    both = paths.visible & shown
    assert np.median(error[both]) < 0.1
    assert np.percentile(error[both], 95) < 0.5
    assert both.sum() > 0.95 * shown.sum()


def test_points_let_go_come_back_to_where_they_were(tracked):
    paths, true, shown = tracked
    moved = np.linalg.norm(true - true[:, :1], axis=-1).max(1) > 2
    back = moved & shown[:, 0] & shown[:, -1]
    assert back.sum() > 20
    assert paths.visible[back, -1].mean() > 0.95
    assert np.median(np.linalg.norm(paths.xy - true, axis=-1)[back, -1]) < 0.1


def test_what_the_instrument_hides_is_not_said_to_be_seen(tracked, sheet):
    paths, _, _ = tracked
    near = np.clip(np.rint(paths.xy).astype(int), 0, np.array(sheet.tool.shape[:0:-1]) - 1)
    frames = np.arange(len(sheet.tool))
    assert not (paths.visible & sheet.tool[frames, near[..., 1], near[..., 0]]).any()
    assert np.isfinite(paths.xy).all()


def test_sigma_is_larger_where_the_error_is(tracked):
    paths, true, _ = tracked
    error = np.linalg.norm(paths.xy - true, axis=-1)
    assert np.median(paths.sigma[error > 1]) > 5 * np.median(paths.sigma[error < 0.2])


def test_a_patch_is_found_to_a_few_hundredths_of_a_pixel_in_another_light():
    rng = np.random.default_rng(0)
    y, x = np.mgrid[:60, :80].astype(float)
    waves = [(rng.uniform(-0.4, 0.4, 2), rng.uniform(0, 6)) for _ in range(12)]

    def image(dx, dy):
        return (100 + sum(8 * np.sin(k[0] * (x - dx) + k[1] * (y - dy) + p) for k, p in waves)).astype(np.float32)

    none = np.zeros((60, 80), bool)
    queries = np.array([[30.0, 25.0], [50.3, 30.7]])
    still = np.stack([x, y], -1).astype(np.float32)
    found = find(templates(image(0, 0), queries, none, radius=6), 0.6 * image(0.7, -0.4) + 20, still, none)
    assert np.allclose(found.shift, [0.7, -0.4], atol=0.03)
    assert (found.likeness > 0.99).all()


def test_spreading_keeps_what_is_known_and_fills_the_rest_from_it():
    y, x = np.mgrid[:40, :50]
    plane = np.stack([x + 2.0 * y, x - y], -1)
    known = np.ones((40, 50))
    known[10:20, 20:30] = 0
    filled = spread(plane, known)
    assert np.allclose(filled[known > 0], plane[known > 0], atol=1e-3)
    assert np.abs(filled - plane).max() < 6
    assert not spread(plane, np.zeros((40, 50))).any()


def test_tracks_are_lifted_to_where_the_tissue_is(sheet):
    tracks, _ = follow(*_stage(sheet), Tracking(points=150, points_near_grasp=0))
    seen = tracks.visible[:, 10]
    near = np.rint(tracks.xy[:, 0]).astype(int)
    true = sheet.xyz[10, near[:, 1], near[:, 0]] - sheet.xyz[0, near[:, 1], near[:, 0]]
    change = tracks.xyz[:, 10] - tracks.xyz[:, 0]
    assert np.median(np.linalg.norm(change - true, axis=-1)[seen]) < 2e-4
    assert np.isnan(tracks.xyz[~tracks.visible]).all()
    assert 120 < len(tracks.xy) < 180


def test_the_same_recording_gives_the_same_bytes(sheet):
    few = slice(0, 6)
    queries = np.array([[40.0, 40.0], [70.0, 60.0]])
    none = np.zeros_like(sheet.tool)[few]
    surfaces = [between(sheet.rgb[few], none) for _ in range(2)]
    a, b = (flow_chain.track(sheet.rgb[few], s, none, queries, settings=Tracking()) for s in surfaces)
    assert a.xy.tobytes() == b.xy.tobytes()


def test_a_network_is_asked_in_its_own_layout_and_a_missing_one_is_named(sheet, tmp_path):
    torch = pytest.importorskip("torch")

    class Still(torch.nn.Module):
        def forward(self, video, queries):
            frames = video.shape[1]
            xy = queries[:, None, :, 1:].repeat(1, frames, 1, 1)
            return xy, torch.ones(1, frames, queries.shape[1])

    torch.jit.script(Still()).save(str(tmp_path / "still.pt"))
    queries = np.array([[40.0, 30.0], [70.0, 40.0]])
    none = np.zeros_like(sheet.tool)
    still = SimpleNamespace(hidden=none)
    settings = Tracking(backend="cotracker", weights=tmp_path / "still.pt")
    paths = cotracker.track(sheet.rgb, still, none, queries, settings=settings)
    assert np.allclose(paths.xy, queries[:, None])
    assert paths.visible.all()
    for path in (None, tmp_path / "nowhere.pt"):
        with pytest.raises(Problem, match="flow_chain"):
            cotracker.track(sheet.rgb, still, none, queries, settings=Tracking(weights=path))


def _shown(sheet, true):
    near = np.clip(np.rint(true).astype(int), 0, np.array(sheet.tool.shape[:0:-1]) - 1)
    hidden = sheet.tool[np.arange(len(sheet.tool)), near[..., 1], near[..., 0]]
    return ~hidden & ~hidden[:, :1]


def _stage(sheet):
    frames = Frames(sheet.rgb, np.zeros(len(sheet.rgb), np.uint8))
    masks = Masks(sheet.tool, ~sheet.tool, np.zeros_like(sheet.tool), np.ones(len(sheet.tool), np.float32))
    depth = Depth(sheet.depth.astype(np.float32), np.ones(sheet.depth.shape, np.float32), "known")
    return frames, masks, correspond(frames, masks, Correspondence()), depth, sheet.camera


def test_a_point_that_is_not_recognised_is_carried_on_from_where_it_was():
    queries = np.array([[10.0, 12.0], [20.0, 8.0]])
    x, y = np.meshgrid(np.arange(32.0), np.arange(24.0))
    place = np.stack([x + 3, y + 1], -1).astype(np.float32)
    followed, error = np.ones((24, 32), bool), np.full((24, 32), 0.1, np.float32)
    nothing, last = np.zeros((24, 32), bool), np.array([[0.4, -0.2], [0.1, 0.3]])
    found = Found(np.array([[0.2, 0.0], [0.2, 0.0]]), np.array([0.1, 0.1]), np.array([0.9, 0.5]))
    patches = SimpleNamespace(queries=queries)
    xy, visible, _, shift = flow_chain._place(patches, place, followed, error, found, nothing, last)
    assert visible.all()
    assert xy == pytest.approx(queries + (3, 1) + [[0.2, 0.0], [0.1, 0.3]], abs=1e-4)
    assert shift == pytest.approx(np.array([[0.2, 0.0], [0.1, 0.3]]))
