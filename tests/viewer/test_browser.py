"""A hand in the browser: click on tissue, drag the arrows, see the body follow, export, and replay by command."""

import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from browser import Browser, installed

from surgisim.artifacts.base import load
from surgisim.artifacts.replay import Replay
from surgisim.mpm.carried import Carried
from surgisim.viewer.app import SCALE, Viewer

ROOT = Path(__file__).parents[2]


def until(what, seconds=60.0):
    """Wait for it; what is waited for is the page's work on a machine that may be busy."""
    for _ in range(int(10 * seconds)):
        if what():
            return
        time.sleep(0.1)
    raise AssertionError("the page did not come so far")


@pytest.mark.skipif(not installed(), reason="NO BROWSER: chromium and chromedriver are wanted here")
def test_what_is_dragged_in_a_browser_moves_the_body_and_replays_by_command(case, out, tmp_path):
    viewer = Viewer(case, tmp_path, port=0)
    loop = threading.Thread(target=viewer.serve, daemon=True)
    loop.start()
    with Browser(1200, 900, webgl=True) as browser:
        browser.resize(1200, 900)
        browser.open(viewer.address)
        browser.press("By hand")
        browser.press("Pull")
        until(lambda: viewer.tool == "pull")
        place = (
            "const c = document.querySelector('canvas').getBoundingClientRect(); return [c.x, c.y, c.width, c.height]"
        )
        x, y, width, height = browser.run(place)
        middle = np.array([x + width / 2, y + height / 2])

        def clicked() -> bool:
            browser.drag(tuple(middle))
            time.sleep(0.5)
            return bool(viewer.grasps)

        until(clicked)
        before = browser.screenshot()
        browser.press("Start")
        until(lambda: viewer.hand is not None and viewer.hand.frame > 2)
        # The camera stands where the recording's stood, with its angle from top to bottom.
        focal = height / (case.camera.height / case.camera.fy)
        at = np.array(viewer.gizmos[0].position)
        arrow = at + np.array([0.8 * 0.2 * viewer.size, 0.0, 0.0])
        tip = middle + focal * arrow[:2] / arrow[2]
        browser.drag(tuple(tip), *(tuple(tip + np.array([20.0 * k, 0.0])) for k in (1, 2, 3)))
        until(lambda: abs(viewer.hand.offsets[0, 0]) > 1e-3)
        gone = np.array(viewer.gizmos[0].position) - at
        assert gone[0] > 0.1
        assert np.abs(gone[1:]).max() < 1e-6
        until(lambda: np.allclose(viewer.hand.offsets[0], gone / SCALE, atol=1e-5))
        assert browser.screenshot() != before
        browser.press("Pause")
        until(lambda: not viewer.running)
        browser.press("Export operation")
        until(lambda: list(tmp_path.glob("operations/*.json")))
        assert not [line for line in browser.log() if "SEVERE" in line and "favicon" not in line]
    hand = viewer.hand
    seen, frame = Carried(case.body.rest, hand.active).at(hand.state[0])[0], hand.frame
    viewer.close()
    loop.join(10)

    home, replayed = out / "results" / "slab" / "main", tmp_path / "replay.npz"
    operation = next(tmp_path.glob("operations/*.json"))
    reads = {
        "body": "estimation/body.npz", "scene": "reconstruction/scene.ply", "material": "estimation/material.npz",
        "physics": "estimation/physics.json", "motion": "estimation/motion.npz", "camera": "ingest/camera.json",
        "frames": "ingest/frames.npz", "masks": "masking/masks.npz",
    }  # fmt: skip
    command = [sys.executable, str(ROOT / "stages" / "simulation.py"), "--operation", str(operation)]
    for name, file in reads.items():
        command += [f"--{name}", str(home / file)]
    for name in ("replay.npz", "video.mp4", "final.ply", "yt.png"):
        command += [f"--{name.split('.')[0]}", str(tmp_path / name)]
    done = subprocess.run([*command, "--settings", '{"relight": false}'], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    again, size = load(Replay, replayed).position[frame], np.ptp(case.body.rest, axis=0).max()
    assert np.abs(seen - case.body.rest).max() > 0.02 * size
    assert np.abs(seen - again).max() < 1e-4 * size
