"""Grips of real recordings, without hints, where a person who looks sees them.

All of them, at full size: `python -m surgisim.proof.grasps` (docs/grasps.md). Here one, at half the size.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from surgisim.artifacts.depth import Depth
from surgisim.config.base import parse
from surgisim.config.correspondence import Correspondence
from surgisim.config.ingest import Ingest
from surgisim.config.masking import Masking
from surgisim.config.tracking import Tracking
from surgisim.perception.ingest.clip import ingest
from surgisim.perception.masking.outline import masks
from surgisim.perception.tracking.correspond import correspond
from surgisim.perception.tracking.follow import follow
from surgisim.proof.grasps import NEAR, SOON, compare

MARKS = json.loads((Path(__file__).parent / "real_grips.json").read_text())["clips"]


def silent(*_):
    pass


@pytest.mark.slow
@pytest.mark.parametrize("name", ["p10"])
def test_a_real_grip_is_found_and_let_go_where_and_when_it_is(shared, name):
    clip = MARKS[name]
    settings = {"size": 160} | ({"crop": clip["crop"]} if "crop" in clip else {})
    frames, camera, given = ingest(
        shared / "data" / clip["recording"], parse(Ingest, settings, "ingest"), progress=silent
    )
    found = masks(frames, given, camera, Masking(), progress=silent)
    surface = correspond(frames, found, Correspondence())
    flat = np.full(found.tool.shape, 0.1, np.float32)
    depth = Depth(flat, np.ones_like(flat), "known")
    motion = follow(frames, found, surface, depth, camera, parse(Tracking, {}, "tracking"))[1]
    assert len(motion.radius) == len(clip["grips"])
    for row in compare(clip["grips"], motion, camera):
        assert row["away_px"] < NEAR, row
        assert abs(row["end"][1] - row["end"][0]) <= SOON, row


def test_marks_say_what_and_how_sure():
    for name, clip in MARKS.items():
        assert clip["grips"], name
        for grip in clip["grips"]:
            assert 0 <= grip["begin"] < grip["end"]
            assert len(grip["doubt"]) == 3
