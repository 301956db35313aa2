"""Where a grasp is unsure the run says at once what it saw and how to mark it."""

import re

import numpy as np
from pulled_points import H, Pull, W, course, pulled
from pulled_sheet import camera, pull_sheet

from surgisim.artifacts.depth import Depth
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.clips import merge_entry
from surgisim.config.base import parse
from surgisim.config.correspondence import Correspondence
from surgisim.config.tracking import Tracking
from surgisim.perception.grasp.find import Grip
from surgisim.perception.grasp.instruments import instruments
from surgisim.perception.grasp.say import advice
from surgisim.perception.tracking.correspond import correspond
from surgisim.perception.tracking.follow import follow


def tools():
    tool, flow, _, _ = pulled([Pull((127, 40), (70, 50), course(20, 5, 15, (6, 0)), np.zeros(20, bool))])
    return instruments(tool, np.ones((H, W), bool), flow)


def test_the_option_is_in_the_recordings_own_pixels_and_seconds():
    from dataclasses import replace

    large = replace(camera(W, H, 20), source_size=[2 * W + 40, 2 * H], crop=[40, 0, 2 * W, 2 * H])
    words = advice([Grip(np.array([70.0, 50.0]), 5.0, 5, 15, 0.3, 6.0, 0)], tools(), large)
    x, y, radius, start, end = map(float, re.search(r"--grasp (\S+)", words).group(1).split(","))
    assert (abs(x - 181) <= 1, abs(y - 101) <= 1, radius) == (True, True, 10)
    assert (start, end) == (0.2, 0.6)
    assert "tissue moves 12.0 px with the instrument from the right" in words


def test_the_option_it_offers_is_one_that_can_be_given():
    words = advice([], tools(), camera(W, H, 20))
    settings = {}
    merge_entry(settings, "grasp", re.search(r"--grasp (\S+)", words).group(1), None, "here")
    assert len(parse(Tracking, settings["tracking"], "tracking").grasp) == 1


def test_without_an_instrument_it_says_so():
    assert "no instrument is masked" in advice([], [], camera(W, H, 20))


def test_a_run_that_finds_no_grasp_says_how_to_mark_one(capsys):
    sheet = pull_sheet(frames=16, begin=4, release=12, pull=(0.0, 0.0, 0.0))
    masks = Masks(sheet.tool, ~sheet.tool, np.zeros_like(sheet.tool), np.ones(len(sheet.tool)))
    depth = Depth(sheet.depth.astype(np.float32), np.ones(sheet.depth.shape, np.float32), "known")
    frames = Frames(sheet.rgb, np.zeros(len(sheet.rgb), np.uint8))
    surface = correspond(frames, masks, Correspondence())
    follow(frames, masks, surface, depth, sheet.camera, parse(Tracking, {}, "tracking"))
    said = capsys.readouterr().err
    assert "the instrument from the right" in said
    assert re.search(r"--grasp \d+,\d+,\d+,[\d.]+,[\d.]+ ", said)
