"""Frames a second of a body under the hand: simulated, carried to splats and sent to a page that is open, as JSON.

    python -m surgisim.viewer.benchmark --particles 5300 --gaussians 25000
    python -m surgisim.viewer.benchmark --particles 105000 --gaussians 50000 --grid 50 --device cuda

The page is a client of this process's own that takes in all that is sent; drawing is the browser's work and its GPU's.
"""

import argparse
import json
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import trimesh
import viser
import warp as wp
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.material import Material
from surgisim.artifacts.physics import Physics
from surgisim.artifacts.replay import Replay
from surgisim.deformation.field import save_field, still_field
from surgisim.gaussians.attributes import stored
from surgisim.mpm.benchmark import VALUES, block
from surgisim.mpm.grid import Grid
from surgisim.mpm.setup import prepare
from surgisim.physics.catalogue import choose, columns
from surgisim.viewer.app import SCALE, Viewer
from surgisim.viewer.case import Case

FPS, WIDTH, HEIGHT = 25.0, 640, 512
WARM = 5
"""Frames that load kernels and record graphs."""


def invented(particles: int, gaussians: int, grid: int, folder: Path, device: str) -> Case:
    """A block of tissue with splats on its face."""
    body, motion = block(particles, grid)
    made = prepare(body, tuple(VALUES), density=1050.0, device=device)
    per_frame = made.per_frame(VALUES, FPS)
    terms = {law: {n: {"value": v, "unit": ""} for n, v in numbers.items()} for law, numbers in VALUES.items()}
    physics = Physics(terms, 1050.0, [0.0] * 3, {"spacing": body.spacing, "step": 1 / FPS / per_frame})
    names = np.array(columns(choose(terms)))
    material = Material(names=names, values=made.theta(VALUES).astype(np.float32), held=body.held)
    rng = np.random.default_rng(0)
    low, high = body.rest.min(0), body.rest.max(0)
    mean = np.c_[rng.uniform(low[:2], high[:2], (gaussians, 2)), np.full(gaussians, low[2])]
    radius = np.full((gaussians, 3), np.sqrt(np.prod((high - low)[:2]) / gaussians))
    still = np.tile([1.0, 0, 0, 0], (gaussians, 1))
    scene = stored(mean, still, radius, np.full(gaussians, 0.9), rng.uniform(0, 1, (gaussians, 3)))
    lens = {"fx": 1.2 * WIDTH, "fy": 1.2 * WIDTH, "cx": (WIDTH - 1) / 2, "cy": (HEIGHT - 1) / 2, "fps": FPS}
    clip = {"frames": 2, "scale": "known", "focal_from": "given", "source": "benchmark"}
    camera = Camera(WIDTH, HEIGHT, **lens, **clip, source_size=[WIDTH, HEIGHT], crop=[0, 0, WIDTH, HEIGHT])
    frames = Frames(np.zeros((2, HEIGHT, WIDTH, 3), np.uint8), np.zeros(2, np.uint8))
    nodes = Grid.around(body.rest, body.spacing, mean)
    replay = Replay(
        time=np.arange(2) / FPS, position=np.repeat(body.rest[None], 2, 0).astype(np.float32),
        nodes=np.zeros((2, nodes.count, 3), np.float32), origin=nodes.origin, shape=nodes.shape, spacing=nodes.spacing,
        smallest_volume_ratio=np.ones(2), energy=np.zeros((2, 2)), rgb=np.zeros((0, HEIGHT, WIDTH, 3), np.uint8),
    )  # fmt: skip
    box = np.array([[*low, 0.0], [*high, 1.0]])
    field = still_field(box[0], box[1], np.full((1, 4), 4), 2, 4, rng)
    deformation = save_field(field, np.arange(2) / FPS, np.zeros((1, gaussians, 3)), np.zeros((0, 5)))
    mesh = folder / "body_mesh.ply"
    trimesh.creation.box(bounds=[low, high]).export(mesh)
    return Case(
        "benchmark", "main", camera, frames, scene, deformation, body, mesh, material, physics, motion, replay, None
    )


class Listener:
    """A page that takes in everything and draws nothing."""

    def __init__(self, port: int) -> None:
        self.bytes = 0
        self.socket = connect(
            f"ws://localhost:{port}", subprotocols=[f"viser-v{viser.__version__}"], max_size=None, compression=None
        )
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        try:
            while True:
                self.bytes += len(self.socket.recv())
        except ConnectionClosed:
            return


def measure(particles: int, gaussians: int, grid: int, frames: int, device: str) -> dict:
    """Frames a second while a grip in the middle of the face is dragged to and fro."""
    with tempfile.TemporaryDirectory() as home:
        case = invented(particles, gaussians, grid, Path(home), device)
        viewer = Viewer(case, Path(home), port=0, device=device)
        page = Listener(viewer.gate.port)
        face = case.body.rest[case.body.surface]
        place = face[np.linalg.norm(face - face.mean(0), axis=1).argmin()].astype(float)
        viewer.add_grasp(place, np.zeros(3))
        viewer.begin()
        reach = 0.15 * float(np.ptp(case.body.rest[:, 0]))
        once = 32 * gaussians
        for k in range(frames + WARM):
            if k == WARM:
                before, began = page.bytes, time.perf_counter()
            viewer.gizmos[0].position = SCALE * (place + np.array([reach * np.sin(0.2 * k), 0.0, -0.5 * reach]))
            viewer.step()
        took = time.perf_counter() - began
        time.sleep(1.0)
        shown = (page.bytes - before) / once
        moved = np.abs(viewer.hand.state[0]).max()
        viewer.close()
    return {
        "device": wp.get_device(device).name,
        "particles": len(case.body.rest),
        "gaussians": gaussians,
        "steps_a_frame": round(1 / FPS / case.physics.grid["step"]),
        "frames_per_second": round(shown / took, 1),
        "seconds_of_tissue_a_second": round(frames / FPS / took, 2),
        "megabytes_a_second": round(1e-6 * shown * once / took, 1),
        "largest_displacement_m": round(float(moved), 5),
    }


def main() -> None:
    cli = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    cli.add_argument("--particles", type=int, default=5300)
    cli.add_argument("--gaussians", type=int, default=25_000)
    cli.add_argument("--grid", type=int, default=18, help="cells along the longest side")
    cli.add_argument("--frames", type=int, default=60)
    cli.add_argument("--device", default="cpu")
    print(json.dumps(measure(**vars(cli.parse_args())), indent=1))


if __name__ == "__main__":
    main()
