"""A pulled slab as a run would have left it, small enough to be simulated while somebody watches."""

from pathlib import Path

import numpy as np
import trimesh
from slab import pulled, slab

from surgisim.artifacts.base import save
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.material import Material
from surgisim.artifacts.physics import Physics
from surgisim.config.simulation import Simulation
from surgisim.deformation.field import save_field, still_field
from surgisim.gaussians.attributes import stored
from surgisim.mpm.setup import prepare
from surgisim.physics.catalogue import choose, columns
from surgisim.simulation.replay import replay
from surgisim.viewer.case import Case, read

VALUES = {"corotated": {"E": 2000.0, "nu": 0.4}, "newtonian": {"eta": 2.0}}
UNITS = {"E": "Pa", "nu": "1", "eta": "Pa s"}
FRAMES, WIDTH, HEIGHT = 10, 80, 60
CAMERA = Camera(
    WIDTH, HEIGHT, 90.0, 90.0, 39.5, 29.5, 25.0, FRAMES, "known", "given", "slab", [160, 120], [0, 0, 160, 120]
)


def quiet(*_: object) -> None:
    pass


def run_folder(out: Path) -> Case:
    """Write results/slab/main as the graph does, and read it as the viewer does."""
    body, motion = slab(), pulled(frames=FRAMES, hold=6)
    made = prepare(body, tuple(VALUES), density=1050.0)
    per_frame = made.per_frame(VALUES, CAMERA.fps, safety=0.8)
    grid = {"spacing": body.spacing, "step": 1 / CAMERA.fps / per_frame}
    terms = {
        law: {n: {"value": v, "unit": UNITS[n], "low": 0.9 * v, "high": 1.1 * v} for n, v in numbers.items()}
        for law, numbers in VALUES.items()
    }
    physics = Physics(terms, 1050.0, [0.0, 0.0, 0.0], grid)
    names = np.array(columns(choose(terms)))
    material = Material(names=names, values=made.theta(VALUES).astype(np.float32), held=body.held)
    mean = body.rest[body.surface]
    still = np.tile([1.0, 0, 0, 0], (len(mean), 1))
    shade = 0.5 + 0.4 * np.sin(900 * mean)
    scene = stored(mean, still, np.full((len(mean), 3), 0.0018), np.full(len(mean), 0.9), shade)
    box = np.array([[*mean.min(0), 0.0], [*body.rest.max(0), 1.0]])
    field = still_field(box[0], box[1], np.full((1, 4), 4), 2, 4, np.random.default_rng(0))
    tint = np.zeros((FRAMES - 1, len(mean), 3))
    deformation = save_field(field, np.arange(FRAMES) / CAMERA.fps, tint, np.zeros((0, 5)))
    rgb = np.random.default_rng(0).integers(0, 255, (FRAMES, HEIGHT, WIDTH, 3)).astype(np.uint8)
    frames = Frames(rgb, np.zeros(FRAMES, np.uint8))
    none = np.zeros(rgb.shape[:3], bool)
    masks = Masks(none, ~none, none, np.ones(FRAMES, np.float32))
    moved = replay(body, scene, material, physics, motion, CAMERA, Simulation(render=False), quiet)
    files = {
        "ingest/frames": frames, "ingest/camera": CAMERA, "masking/masks": masks, "reconstruction/scene": scene,
        "reconstruction/deformation": deformation, "estimation/body": body, "estimation/material": material,
        "estimation/physics": physics, "estimation/motion": motion, "simulation/replay": moved,
    }  # fmt: skip
    home = out / "results" / "slab" / "main"
    for name, artifact in files.items():
        save(artifact, home / (name + artifact.SUFFIX), producer="made up", settings={}, code="")
    mesh = trimesh.creation.box(bounds=[body.rest.min(0), body.rest.max(0)]).subdivide().subdivide()
    (home / "thickening").mkdir()
    mesh.export(home / "thickening" / "body_mesh.ply")
    return read(out, "slab", "main")
