"""The truth in one place of a run: in the run's own scale, and nothing else touched."""

from dataclasses import replace

import numpy as np
import pytest
from report.made_up import invent

from surgisim.artifacts.base import load, save
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.tracks import Tracks
from surgisim.measure.truth_seen import seen
from surgisim.proof.revealed import REPLACED

SCALE = 0.5
"""From the run's lengths to the truth's: the run believes all twice as far."""


@pytest.fixture
def run(tmp_path):
    made = invent((40, 48), 12, 0)
    depth = replace(made["depth"], z=made["depth"].z / np.float32(SCALE) + np.float32(0.003), follows=False)
    for stage, name, artifact in (
        ("ingest", "camera.json", made["camera"]),
        ("depth", "depth.npz", depth),
        ("tracking", "tracks.npz", made["tracks"]),
        ("tracking", "motion.npz", made["motion"]),
    ):
        (tmp_path / stage).mkdir(exist_ok=True)
        save(artifact, tmp_path / stage / name, producer="test", settings={}, code="")
    return tmp_path, seen(made["truth"], made["camera"]), made


def test_depth_is_the_truth_at_the_runs_scale_and_counts_as_measured(run):
    folder, truth, _ = run
    REPLACED["depth"](folder, truth, SCALE)
    found = load(Depth, folder / "depth" / "depth.npz")
    assert found.z == pytest.approx(truth.depth / SCALE)
    assert found.follows


def test_tracks_are_the_true_pixels_lifted_with_the_runs_own_depth(run):
    folder, truth, _ = run
    REPLACED["tracks"](folder, truth, SCALE)
    found = load(Tracks, folder / "tracking" / "tracks.npz")
    assert found.xy == pytest.approx(truth.xy[truth.visible[:, 0]], abs=1e-4)
    assert np.nanmedian(found.xyz[:, 0, 2]) == pytest.approx(0.003 + np.median(truth.xyz[:, 0, 2]) / SCALE, rel=0.02)


def test_the_grip_keeps_its_path_and_holds_the_runs_own_surface(run):
    folder, truth, made = run
    REPLACED["grip"](folder, truth, SCALE)
    found, true = load(Motion, folder / "tracking" / "motion.npz"), made["motion"]
    way = found.position - found.center_rest[:, None]
    assert SCALE * way == pytest.approx(true.position - true.center_rest[:, None])
    assert found.center_rest[0, 2] == pytest.approx(true.center_rest[0, 2] / SCALE + 0.003, abs=1e-5)
    assert SCALE * found.radius == pytest.approx(true.radius)
