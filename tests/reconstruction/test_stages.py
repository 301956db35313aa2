import json
import subprocess
import sys
from pathlib import Path

import numpy as np

from surgisim.artifacts.base import load, save
from surgisim.artifacts.body import Body
from surgisim.artifacts.deformation import Deformation
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.ply import read_ply
from surgisim.artifacts.scene import Scene

ROOT = Path(__file__).parents[2]


def stage(name, settings, **paths):
    flags = [part for key, path in paths.items() for part in (f"--{key}", str(path))]
    command = [sys.executable, str(ROOT / "stages" / f"{name}.py"), "--settings", json.dumps(settings), *flags]
    return subprocess.run(command, capture_output=True, text=True)


def test_the_two_stages_make_a_scene_and_a_body(clip, tmp_path):
    reads = {n: tmp_path / f"{n}.npz" for n in ("frames", "inpainted", "masks", "correspondence", "depth")}
    reads["camera"] = tmp_path / "camera.json"
    for name, path in reads.items():
        save(getattr(clip, name), path, producer="test", settings={}, code="")
    wrote = {"scene": tmp_path / "scene.ply"} | {n: tmp_path / f"{n}.npz" for n in ("deformation", "rendered")}
    wanted = stage("reconstruction", {"iterations": 0}, **reads, **wrote)
    assert wanted.returncode == 2
    assert "iterations" in wanted.stderr
    assert not any(path.exists() for path in wrote.values())

    made = stage("reconstruction", {"iterations": 12, "threads": 1}, **reads, **wrote)
    assert made.returncode == 0, made.stderr
    rendered = load(Frames, wrote["rendered"])
    assert rendered.rgb.shape == clip.frames.rgb.shape
    assert np.array_equal(rendered.split, clip.frames.split)
    assert len(load(Scene, wrote["scene"]).mean) > 500
    assert load(Deformation, wrote["deformation"]).history[-1, 0] == 12

    body = {"body": tmp_path / "body.npz", "points": tmp_path / "body.ply", "mesh": tmp_path / "body_mesh.ply"}
    made = stage("thickening", {"cells": 8}, scene=wrote["scene"], camera=reads["camera"], **body)
    assert made.returncode == 0, made.stderr
    columns, _ = read_ply(body["points"])
    assert len(load(Body, body["body"]).rest) == len(columns["x"])
    assert set(columns) >= {"x", "y", "z", "red", "green", "blue", "held", "surface"}
