"""Marking in a browser: a click changes the mask at once, and what is saved is what a run takes."""

import json
import urllib.error
import urllib.request

import cv2
import numpy as np
import pytest
from browser import Browser, installed
from cases import quiet

from surgisim.clips import merge_entry
from surgisim.config.base import parse
from surgisim.config.ingest import Ingest
from surgisim.config.masking import Click, Masking
from surgisim.config.whole import Whole
from surgisim.viewer.pick import Marks, Picking, PickPage

SIZE = (96, 120)


@pytest.fixture
def picking(tmp_path):
    """A clip with a black border of 10 px at its left, and an instrument."""
    rgb = filmed(12)
    clip = tmp_path / "pulled"
    clip.mkdir()
    for k, frame in enumerate(rgb):
        bordered = np.zeros((SIZE[0], SIZE[1] + 10, 3), np.uint8)
        bordered[:, 10:] = frame
        cv2.imwrite(str(clip / f"{k:03d}.png"), bordered[..., ::-1])
    reading = Ingest(size=60, crop=(10, 0, SIZE[1], SIZE[0]))
    return Picking(clip, tmp_path / "marks", reading, Masking(), progress=quiet)


def filmed(frames):
    """Red tissue, and a grey bar that goes in and out."""
    rng = np.random.default_rng(1)
    rough = cv2.GaussianBlur(rng.normal(0, 60, SIZE), (0, 0), 4)
    still = np.clip(np.array([190, 90, 80]) + rough[..., None], 0, 255).astype(np.uint8)
    rgb = np.repeat(still[None], frames, 0)
    for k, frame in enumerate(rgb):
        frame[20:34, : 40 + round(10 * np.sin(k / 2))] = (150, 152, 156)
    return rgb


def until(condition):
    """A script that waits for it, twenty seconds at most."""
    return f"for (let n = 0; n < 200 && !({condition}); n++) await new Promise(later => setTimeout(later, 100))"


def tool_of(png):
    return cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED)[..., 3] > 0


def test_a_click_in_the_recordings_pixels_adds_to_the_mask_at_once(picking):
    plain = tool_of(picking.mask(3, Marks([], [])))
    assert plain.shape == (48, 60)
    away = np.argwhere(~cv2.dilate(plain.astype(np.uint8), np.ones((9, 9), np.uint8)).astype(bool))
    y, x = away[len(away) // 2]
    place = picking.working.to_recording([x, y])
    assert place[0] == pytest.approx(10 + (x + 0.5) * 2 - 0.5)
    marked = tool_of(picking.mask(3, Marks([Click(frame=3, x=place[0], y=place[1])], [])))
    assert marked[y, x]
    assert not plain[y, x]


def test_what_is_saved_is_what_a_run_takes(picking, tmp_path):
    raw = {
        "clicks": [{"frame": 2, "x": 40.5, "y": 30.0, "label": "tissue"}],
        "grasps": [{"pixel": [70.0, 40.0], "radius": 8.0, "end": 0.3}],
    }
    told = picking.save(Marks.parsed(raw))
    clicks, grasp = picking.saved
    assert f"--clicks {clicks} --grasp {grasp}" in told["command"]
    tree = {}
    merge_entry(tree, "clicks", f"@{clicks}", tmp_path, "here")
    merge_entry(tree, "grasp", f"@{grasp}", tmp_path, "here")
    whole = parse(Whole, tree, "here")
    assert whole.masking.clicks[0].label == "tissue"
    assert (whole.tracking.grasp[0].pixel, whole.tracking.grasp[0].end) == ((70.0, 40.0), 0.3)


def test_a_question_that_makes_no_sense_is_answered_with_a_sentence(picking):
    page = PickPage(picking)
    for path, body in (("/frame/99", None), ("/mask", b'{"clicks": [{"frame": 0}], "frame": 0}'), ("/none", b"{}")):
        with pytest.raises(urllib.error.HTTPError) as caught:
            urllib.request.urlopen(urllib.request.Request(page.address.rstrip("/") + path, body), timeout=10)
        assert caught.value.code == 400
    page.close()


@pytest.mark.skipif(not installed(), reason="NO BROWSER: chromium and chromedriver are wanted here")
def test_clicks_and_a_grasp_are_marked_in_a_browser(picking):
    page = PickPage(picking)
    with Browser(1100, 800) as browser:
        browser.resize(1100, 800)
        browser.open(page.address)
        browser.run(until("!mask.hidden && mask.dataset.clicks === '0'"))
        box = browser.run(
            "const b = document.getElementById('picture').getBoundingClientRect(); return [b.x, b.y, b.width, b.height]"
        )

        def at(x, y):
            return box[0] + x * box[2], box[1] + y * box[3]

        browser.press("Tool")
        browser.drag(at(0.25, 0.75))
        browser.run(until("!mask.hidden && mask.dataset.clicks === '1'"))
        assert browser.run("const m = document.getElementById('mask'); return [m.hidden, m.naturalWidth]") == [
            False,
            60,
        ]
        browser.press("Grasp")
        browser.drag(at(0.5, 0.5), at(0.55, 0.5), at(0.6, 0.5))
        browser.press("let go in this frame")
        browser.press("Save")
        browser.run(until("said.textContent.includes('END must be later')"))
        for _ in range(4):
            browser.press("›")
        browser.press("let go in this frame")
        browser.press("Save")
        browser.run(until("said.textContent.includes('Saved')"))
        assert not [line for line in browser.log() if "SEVERE" in line]
    page.close()
    clicks, grasp = (json.loads(path.read_text()) for path in picking.saved)
    assert [(c["frame"], c["label"]) for c in clicks] == [(0, "tool")]
    assert (clicks[0]["x"], clicks[0]["y"]) == pytest.approx((10 + 0.25 * SIZE[1] - 0.5, 0.75 * SIZE[0] - 0.5), abs=0.5)
    assert grasp[0]["radius"] == pytest.approx(0.1 * SIZE[1], abs=0.5)
    assert grasp[0]["end"] == pytest.approx(4 / 25)
