"""A whole run measured: what is known is told with its protocol, what is not is said to be absent."""

import dataclasses
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from report.made_up import invent, made_up

from surgisim.measure.costs import costs
from surgisim.measure.number import NOT_MEASURED, measured, number
from surgisim.measure.run import Run
from surgisim.measure.score import score
from surgisim.measure.truth_seen import seen
from surgisim.problem import Problem

NAMES = [f.name for f in dataclasses.fields(Run) if f.name not in ("truth", "found")]


def run_of(made, **changed) -> Run:
    made = made | changed
    return Run(**{n: made[n] for n in NAMES}, truth=made["truth"] and seen(made["truth"], made["camera"]))


@pytest.fixture(scope="module")
def made():
    return invent((40, 48), 16, 0)


@pytest.fixture(scope="module")
def values(made):
    return score(run_of(made), lpips=None, first=4)


def test_every_number_has_a_unit_and_a_protocol(values):
    for entries in values.values():
        for name, entry in entries.items():
            assert {"value", "unit", "protocol"} <= set(entry), name
            assert entry["protocol"], name
    json.dumps(values, allow_nan=False)


def test_a_good_run_scores_well(values):
    assert values["masking"]["tool_iou"]["value"] > 0.95
    assert values["tracking"]["median"]["value"] < 0.3
    assert values["depth"]["true_relative"]["value"] == pytest.approx(0, abs=1e-4)
    assert values["grasp"]["center"]["value"] == 0
    assert values["replay"]["sane"]["value"] == 1


def test_pixels_that_are_black_in_both_count_as_right_where_others_count_so(made):
    frames, tool = made["frames"], made["masks"].tool
    off = np.where(frames.rgb < 128, frames.rgb + 10, frames.rgb - 10).astype(np.uint8)
    depth = np.ones(tool.shape, np.float32)
    depth[:, :, :12] = 0
    drawn = dataclasses.replace(frames, rgb=off)
    given = dataclasses.replace(made["given"], depth=depth)
    of = score(run_of(made, rendered=drawn, given=given), lpips=None, first=4)["reconstruction"]
    share = (~tool & (depth > 0))[frames.split == 1].mean((1, 2))
    assert tool[frames.split == 1].any()
    assert of["psnr_between_outside"]["value"] == pytest.approx(20 * np.log10(25.5))
    assert of["psnr_between_black"]["value"] == pytest.approx(20 * np.log10(25.5) - 10 * np.log10(share).mean())
    assert of["ssim_between_black"]["value"] > 0.2 * share.min()
    assert "lpips_between_black" not in of


def test_a_replay_nine_tenths_as_far_is_a_tenth_off(values):
    moving = values["simulation"]["true_used_moving"]["value"]
    still = values["simulation"]["true_used_moving_still"]["value"]
    assert moving == pytest.approx(0.1 * still, rel=0.15)


def test_a_body_that_never_moves_scores_as_if_nothing_moved(made):
    stays = np.broadcast_to(made["body"].rest, made["replay"].position.shape)
    still = dataclasses.replace(made["replay"], nodes=0 * made["replay"].nodes, position=stays)
    entries = score(run_of(made, replay=still), lpips=None, first=4)["simulation"]
    for part in ("used", "held_out", "released"):
        unmoved = entries[f"true_{part}_moving_still"]["value"]
        assert entries[f"true_{part}_moving"]["value"] == pytest.approx(unmoved, rel=1e-5)


def test_a_replay_of_another_length_is_not_held_against_the_recording(made):
    replay = made["replay"]
    halves = {
        n: getattr(replay, n)[:8] for n in ("time", "position", "nodes", "smallest_volume_ratio", "energy", "rgb")
    }
    values = score(run_of(made, replay=dataclasses.replace(replay, **halves)), lpips=None, first=4)
    assert not any(name.startswith("true") for name in values["simulation"])
    assert "another manipulation" in values[NOT_MEASURED]["simulation.tracked_held_out"]["protocol"]


def test_an_arbitrary_scale_costs_nothing_where_one_factor_explains_it(made, values):
    depth = dataclasses.replace(made["depth"], z=2 * made["depth"].z)
    found = score(run_of(made, depth=depth), lpips=None, first=4)["depth"]["true_relative"]["value"]
    assert found == pytest.approx(values["depth"]["true_relative"]["value"], abs=1e-4)
    known = dataclasses.replace(depth, scale="known")
    assert score(run_of(made, depth=known), lpips=None, first=4)["depth"]["true_relative"]["value"] > 90


def test_what_cannot_be_had_is_absent_and_says_why(made):
    values = score(run_of(made, truth=None), lpips=None, first=4)
    assert "tool_iou" not in values["masking"]
    assert "no truth" in values[NOT_MEASURED]["masking.tool_iou"]["protocol"]
    assert "no weights" in values[NOT_MEASURED]["reconstruction.lpips_used"]["protocol"]


def test_a_number_that_is_none_is_not_written():
    groups = measured({"a": {"x": number(float("nan"), "1", "p", why_not="nothing there"), "y": number(1, "1", "p")}})
    assert list(groups["a"]) == ["y"]
    assert groups[NOT_MEASURED]["a.x"]["protocol"] == "nothing there"
    assert number(1, "1", "p", series=np.array([1, np.nan]))["series"] == [1, None]


def test_artifacts_of_two_clips_are_not_one_run(made):
    other = invent((40, 48), 12, 0)
    with pytest.raises(Problem, match="not of one clip"):
        run_of(made, depth=other["depth"])


def test_benchmark_files_give_time_and_memory(tmp_path):
    (tmp_path / "depth.tsv").write_text("s\th:m:s\tmax_rss\n2.5\t0:00:02\t300.1\n")
    (tmp_path / "ingest.tsv").write_text("s\th:m:s\tmax_rss\n0.1\t0:00:00\t-\n")
    wanted = {"depth": {"seconds": 2.5, "peak_mb": 300.1}, "ingest": {"seconds": 0.1}}
    assert costs(tmp_path) == wanted
    assert costs(Path(f"{tmp_path}/depth.tsv:{tmp_path}/ingest.tsv")) == wanted
    with pytest.raises(Problem, match="no such benchmark file"):
        costs(tmp_path / "other.tsv")


def test_the_stage_writes_the_same_bytes_twice(tmp_path):
    paths = made_up(tmp_path)
    texts = []
    for name in ("one.json", "two.json"):
        flags = [f"--{n}={paths[n]}" for n in (*NAMES, "truth")]
        script = Path(__file__).parents[2] / "stages" / "evaluation.py"
        subprocess.run([sys.executable, script, *flags, f"--metrics={tmp_path / name}"], check=True)
        texts.append((tmp_path / name).read_bytes())
    assert texts[0] == texts[1]
    assert json.loads(texts[0])["clip"] == "made_up"
