"""Instruments are followed from one click each; the network is stood in for by one that draws what has one colour."""

import cv2
import numpy as np
import pytest
from recordings import tissue

from surgisim.config.masking import Click
from surgisim.perception.masking.clicked import followed
from surgisim.perception.masking.drawing import Embedded, inner_points, overlap
from surgisim.perception.masking.remembering import belief, remember

SIZE, SIDE = (96, 128), 64


class OneColour:
    """Draws what is of the colour of each point inside, around it; or of the first alone; or the whole frame."""

    def __init__(self):
        self.looked_at = 0

    def embedded(self, frame: np.ndarray) -> Embedded:
        self.looked_at += 1
        small = cv2.resize(frame, (SIDE, SIDE), interpolation=cv2.INTER_AREA).astype(np.float32) - 110
        return Embedded({"image_embed": small.transpose(2, 0, 1)[None], "frame": frame}, frame.shape[:2])

    def drawn(self, frame: Embedded, points, hint):
        picture, regions = frame.tensors["frame"].astype(int), []
        for x, y, _ in (point for point in points if point[2] == 1):
            like = (np.abs(picture - picture[round(y), round(x)]).max(-1) < 25).astype(np.uint8)
            _, region = cv2.connectedComponents(like)
            regions.append(region == region[round(y), round(x)])
        return [(np.any(regions, 0), 0.9), (regions[0], 0.8), (np.ones(frame.size, bool), 0.1)]


def passing(count=9, second_from=0):
    """A blue bar from the left goes down, a green one from the right goes up, over still tissue."""
    rgb, tools = [], np.zeros((count, 2, *SIZE), bool)
    for t in range(count):
        frame = tissue(1, SIZE)
        tools[t, 0, 10 + 4 * t : 24 + 4 * t, : 50 + 3 * t] = True
        if t >= second_from:
            tools[t, 1, 74 - 4 * t : 88 - 4 * t, 90 - t :] = True
        frame[tools[t, 0]], frame[tools[t, 1] & ~tools[t, 0]] = (60, 80, 200), (60, 190, 60)
        rgb.append(frame)
    return np.stack(rgb), tools


NOTHING = np.zeros((9, *SIZE), bool)
BLUE, GREEN = Click(frame=4, x=20, y=32), Click(frame=4, x=115, y=66)


def follow(rgb, rough, *clicks, network=None):
    return followed(rgb, rough, clicks, network or OneColour(), lambda share: None)


def test_one_click_on_each_follows_both_to_either_end():
    rgb, tools = passing()
    masks, sure = follow(rgb, NOTHING, BLUE, GREEN)
    assert min(map(overlap, masks, tools.any(1))) > 0.95
    assert np.allclose(sure, 0.9)


def test_what_was_not_clicked_is_not_followed():
    rgb, tools = passing()
    masks, _ = follow(rgb, NOTHING, BLUE)
    assert min(map(overlap, masks, tools[:, 0])) > 0.95


def test_one_that_comes_later_is_clicked_later_and_each_frame_is_looked_at_once():
    rgb, tools = passing(second_from=6)
    network = OneColour()
    masks, _ = follow(rgb, NOTHING, Click(frame=0, x=20, y=16), Click(frame=6, x=115, y=57), network=network)
    assert min(map(overlap, masks[6:], tools[6:].any(1))) > 0.95
    assert min(map(overlap, masks[:6], tools[:6, 0])) > 0.95
    assert network.looked_at <= 9 + 6


def test_a_second_click_on_the_same_thing_makes_no_second_thing():
    rgb, tools = passing()
    masks, _ = follow(rgb, NOTHING, BLUE, Click(frame=4, x=40, y=30), GREEN)
    assert min(map(overlap, masks, tools.any(1))) > 0.95


def test_a_frame_without_the_thing_has_no_mask_and_it_is_found_again():
    rgb, tools = passing()
    gone = tissue(1, SIZE)
    rgb[6] = gone
    masks, sure = follow(rgb, NOTHING, BLUE, GREEN)
    assert not masks[6].any()
    assert sure[6] == 0
    assert min(map(overlap, masks[7:], tools[7:].any(1))) > 0.95


def test_what_colour_found_comes_in_where_it_hangs_together_with_the_thing():
    """A part of another colour, that the network does not draw from the click alone."""
    rgb, tools = passing()
    part = np.zeros_like(NOTHING)
    for t in range(9):
        part[t, 10 + 4 * t : 24 + 4 * t, :20] = True
        rgb[t][part[t]] = (200, 200, 210)
    rough = tools[:, 0] & ~tools[:, 1]
    masks, _ = follow(rgb, rough, Click(frame=4, x=40, y=32))
    assert min(map(overlap, masks, tools[:, 0])) > 0.95


def test_an_outline_that_takes_in_clicked_tissue_is_passed_over():
    """Colour takes everything for the instrument, and the network can draw everything."""
    rgb, tools = passing()
    astray = NOTHING.copy()
    astray[4] = True
    assert follow(rgb, astray, BLUE)[0][4, 90, 100]
    masks, _ = follow(rgb, astray, BLUE, Click(frame=4, x=100, y=90, label="tissue"))
    assert overlap(masks[4], tools[4, 0]) > 0.95


def test_places_that_look_alike_are_believed_to_be_the_same_thing_near_by_or_anywhere():
    rng = np.random.default_rng(0)
    places = rng.standard_normal((16, 16, 24)).astype(np.float32)
    places /= np.linalg.norm(places, axis=-1, keepdims=True)
    region = np.zeros((64, 64), bool)
    region[8:24, 8:24] = True
    there = np.zeros((64, 64), bool)
    there[8:24, 40:56] = True
    moved = np.roll(places, 8, axis=1)
    anywhere = belief(moved, [remember(places, region, everywhere=True)], (64, 64), {}) > 0.5
    near_by = belief(moved, [remember(places, region, everywhere=False)], (64, 64), {}) > 0.5
    assert overlap(anywhere, there) > 0.8
    assert overlap(near_by, there) < 0.2


def test_points_to_show_lie_inside_and_apart():
    region = np.zeros((40, 120), bool)
    region[10:30, :] = True
    points = inner_points(region, 3)
    assert len(points) == 3
    assert all(region[y, x] for x, y in points)
    assert min(np.hypot(a[0] - b[0], a[1] - b[1]) for a in points for b in points if a != b) > 10
    assert not inner_points(np.zeros((9, 9), bool), 2)
    assert inner_points(np.ones((9, 12), bool), 2)


@pytest.mark.slow
def test_sam2_follows_the_instruments_of_the_pulling_clip_from_one_click_each(shared):
    """Given masks are wider than instruments: nearly all that is found lies inside, and widened it fills them."""
    from recordings import silent

    from surgisim.config.ingest import Ingest
    from surgisim.config.masking import Masking
    from surgisim.perception.ingest.clip import ingest
    from surgisim.perception.masking.outline import masks
    from surgisim.proof.learned.outlines import beside

    frames, camera, given = ingest(shared / "data/endonerf_pulling", Ingest(end=0.6), progress=silent)
    files = {which: shared / f"weights/sam2_hiera_tiny_{which}_w8.onnx" for which in ("encoder", "decoder")}
    clicks = [Click(frame=12, x=74.5, y=238.5), Click(frame=12, x=606.5, y=352.5)]
    settings = Masking(backend="sam2", clicks=clicks, **files)
    told = beside(masks(frames, given, camera, settings, progress=silent).tool, given.tool, 12)
    assert told["inside_given"]["min"] > 0.97
    assert told["overlap_widened"]["mean"] > 0.9
