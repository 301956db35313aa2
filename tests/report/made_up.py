"""A whole run's artifacts, invented in a second: a slanted sheet pulled by one grip and let go."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from surgisim.artifacts.base import Artifact, save
from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.deformation import Deformation
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.fit import Fit
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.artifacts.inpainted import Inpainted
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.material import Material
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.physics import Physics
from surgisim.artifacts.replay import Replay
from surgisim.artifacts.scene import Scene
from surgisim.artifacts.tracks import Tracks
from surgisim.artifacts.truth import Truth
from surgisim.deformation.field import save_field, still_field

RADIUS, REACH, PULL = 0.004, 0.009, np.array([0.003, -0.006, -0.004])
"""Of the grip, of the field it drags along, and how far it goes [m]."""


@dataclass(frozen=True)
class World:
    """What really happens, in metres."""

    camera: Camera
    rng: np.random.Generator
    center: np.ndarray
    amount: np.ndarray
    """How far the pull has gone, (T,), 0-1."""

    def field(self, points: np.ndarray, t: int, strength: float = 1.0) -> np.ndarray:
        """Displacement [m] of rest points (..., 3)."""
        near = np.exp(-(((points - self.center) / REACH) ** 2).sum(-1) / 2)
        return strength * self.amount[t] * near[..., None] * PULL

    def depth_rest(self) -> np.ndarray:
        y, x = np.mgrid[: self.camera.height, : self.camera.width]
        relief = 0.002 * np.sin(7 * x / self.camera.width) * np.cos(5 * y / self.camera.height)
        return 0.07 + 0.012 * y / self.camera.height + relief

    def pixels(self) -> np.ndarray:
        y, x = np.mgrid[: self.camera.height, : self.camera.width]
        return np.stack([x, y], -1).astype(float)


def made_up(folder: Path, *, size: tuple[int, int] = (40, 48), frames: int = 12, seed: int = 0, **changed) -> dict:
    """Write every artifact kind and return name -> path; `changed` replaces artifacts by name."""
    made = invent(size, frames, seed) | changed
    paths = {}
    for name, artifact in made.items():
        if artifact is not None:
            paths[name] = folder / (name + artifact.SUFFIX)
            save(artifact, paths[name], producer="made_up", settings={}, code="")
    return paths


def invent(size: tuple[int, int], frames: int, seed: int) -> dict[str, Artifact]:
    world = _world(size, frames, seed)
    rgb, clean, tool, depth, specular = _film(world)
    split = np.where(np.arange(frames) % 8 == 1, 1, 0).astype(np.uint8)
    split[-max(frames // 6, 2) :] = 2
    found = tool.copy()
    found[:, ::7] = np.roll(tool, 1, 2)[:, ::7]
    noisy = (clean.astype(float) + world.rng.normal(0, 5, clean.shape)).clip(0, 255).astype(np.uint8)
    body, scene, material = _bodies(world, clean[0])
    tracks, truth = _tracks(world, tool, depth)
    tissue = ~found & ~specular
    origin = np.where(found, np.where(world.pixels()[..., 0] % 3 == 0, 2, 1), 0).astype(np.uint8)
    motion = _motion(world, "found")
    replay = _replay(world, body, noisy)
    scale = np.float32(1.3)  # the recording's scale is arbitrary, so depth is off by a factor
    return {
        "frames": Frames(rgb, split),
        "camera": world.camera,
        "given": Given(
            np.zeros((0, *size), bool), np.zeros((0, *size), np.float32), np.zeros((0, *size, 3), np.uint8), 0.0
        ),
        "masks": Masks(found, tissue, specular & ~found, np.linspace(0.95, 0.7, frames).astype(np.float32)),
        "inpainted": Inpainted(clean, origin),
        "depth": Depth((depth * scale / scale).astype(np.float32), np.full(depth.shape, 0.8, np.float32), "arbitrary"),
        "tracks": tracks,
        "motion": motion,
        "scene": scene,
        "deformation": _deformation(world),
        "rendered": Frames(noisy, split),
        "body": body,
        "material": material,
        "physics": _physics(),
        "fit": _fit(),
        "replay": replay,
        "truth": truth,
    }


def _world(size: tuple[int, int], frames: int, seed: int) -> World:
    height, width = size
    camera = Camera(
        width=width,
        height=height,
        fx=1.1 * width,
        fy=1.1 * width,
        cx=(width - 1) / 2,
        cy=(height - 1) / 2,
        fps=12.5,
        frames=frames,
        scale="arbitrary",
        focal_from="assumed",
        source="made_up",
        source_size=[width, height],
        crop=[0, 0, width, height],
    )
    t = np.linspace(0, 1, frames)
    pull = np.clip((t - 0.1) / 0.35, 0, 1)
    amount = np.where(t < 0.7, pull, np.exp(-(t - 0.7) / 0.06) * np.cos((t - 0.7) * 40))
    return World(camera, np.random.default_rng(seed), np.array([0.004, 0.002, 0.078]), amount)


def _film(world: World):
    """Recording, recording without the tool, tool, depth, highlights."""
    camera, rest, pixels = world.camera, world.depth_rest(), world.pixels()
    points = camera.lift(pixels, rest)
    texture = _texture(world, camera.height, camera.width)
    clean, rgb, tool, depth = [], [], [], []
    for t in range(camera.frames):
        moved = points + world.field(points, t)
        flow = (camera.project(moved) - pixels).astype(np.float32)
        back = (pixels - flow).astype(np.float32)
        picture = cv2.remap(texture, back[..., 0], back[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
        clean.append(picture)
        depth.append(
            cv2.remap(
                moved[..., 2].astype(np.float32),
                back[..., 0],
                back[..., 1],
                cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_REPLICATE,
            )
        )
        tip = camera.project(world.center + PULL * world.amount[t])
        shaft = np.zeros(rest.shape, np.uint8)
        cv2.line(shaft, tip.astype(int).tolist(), [camera.width, camera.height // 4], 1, max(camera.width // 12, 2))
        tool.append(shaft.astype(bool))
        rgb.append(np.where(shaft[..., None] > 0, np.array([120, 130, 140], np.uint8), picture))
    rgb = np.array(rgb)
    return rgb, np.array(clean), np.array(tool), np.array(depth), (rgb.min(-1) > 215)


def _texture(world: World, height: int, width: int) -> np.ndarray:
    noise = sum(
        cv2.GaussianBlur(world.rng.normal(0, 1, (height, width)), (0, 0), s) * s * k
        for s, k in ((width / 80 + 0.6, 30), (width / 20, 35), (width / 8, 30))
    )
    base = np.array([196, 96, 84]) + noise[..., None] * np.array([0.7, 1.0, 0.9])
    return np.clip(base, 0, 255).astype(np.uint8)


def _bodies(world: World, picture: np.ndarray) -> tuple[Body, Scene, Material]:
    camera = world.camera
    top = camera.lift(world.pixels(), world.depth_rest())[::2, ::2].reshape(-1, 3)
    color = (picture[::2, ::2].reshape(-1, 3) / 255).astype(np.float32)
    layers = [top * (1 + 0.012 * k / 0.075) for k in np.linspace(0, 1, 6)]
    rest = np.concatenate(layers).astype(np.float32)
    surface = np.arange(len(rest)) < len(top)
    edge = np.abs(rest[:, 0]) > 0.92 * np.abs(rest[:, 0]).max()
    deep = np.arange(len(rest)) >= 5 * len(top)
    count = len(rest)
    shade = np.concatenate([color * (1 - 0.08 * k) for k in range(6)]).astype(np.float32)
    body = Body(rest, np.full(count, 2e-9, np.float32), shade, surface, edge | deep, 0.002)
    g = len(top)
    scale = np.log(0.0009 * np.exp(world.rng.normal(0, 0.2, (g, 3)))).astype(np.float32)
    turn = np.tile(np.array([1, 0, 0, 0], np.float32), (g, 1))
    scene = Scene(top.astype(np.float32), np.full(g, 3, np.float32), scale, turn, color)
    stiff = 3000 * (1 + 0.5 * np.tanh(rest[:, 0] / 0.01))
    names = np.array(["corotated.E", "newtonian.eta"])
    return body, scene, Material(names, np.stack([stiff, np.full(count, 12.0)], -1).astype(np.float32), body.held)


def _tracks(world: World, tool: np.ndarray, depth: np.ndarray) -> tuple[Tracks, Truth]:
    camera, count = world.camera, world.camera.frames
    y, x = np.mgrid[3 : camera.height - 3 : 4, 3 : camera.width - 3 : 4]
    start = np.stack([x.ravel(), y.ravel()], -1).astype(float)
    start = start[~tool[0][start[:, 1].astype(int), start[:, 0].astype(int)]]
    z = world.depth_rest()[start[:, 1].astype(int), start[:, 0].astype(int)]
    rest = camera.lift(start, z)
    xyz = np.stack([rest + world.field(rest, t) for t in range(count)], 1)
    xy = camera.project(xyz)
    inside = np.rint(xy).astype(int).clip(0, [camera.width - 1, camera.height - 1])
    visible = np.stack([~tool[t][inside[:, t, 1], inside[:, t, 0]] for t in range(count)], 1)
    truth = Truth(
        tool,
        depth.astype(np.float32),
        start[::3].astype(np.float32),
        xyz[::3].astype(np.float32),
        visible[::3],
        **_grip(world),
        parameters="{}",
    )
    xy = xy + world.rng.normal(0, 0.15, xy.shape) * (np.arange(count) > 0)[None, :, None]
    found = np.where(visible[..., None], xyz + world.rng.normal(0, 1e-4, xyz.shape), np.nan)
    found[:, 0] = rest
    f4 = np.float32
    sigma = np.full((*visible.shape, 2), 2e-4, f4)
    return Tracks(xy.astype(f4), visible, np.full(visible.shape, 0.3, f4), found.astype(f4), sigma), truth


def _grip(world: World) -> dict[str, np.ndarray]:
    position = (world.center + world.amount[:, None] * PULL)[None]
    active = (np.linspace(0, 1, world.camera.frames) < 0.7)[None]
    return {"center_rest": world.center[None], "radius": np.array([RADIUS]), "position": position, "active": active}


def _motion(world: World, source: str) -> Motion:
    return Motion(**_grip(world), confidence=np.array([0.8]), source=source)


def _replay(world: World, body: Body, rgb: np.ndarray) -> Replay:
    spacing = 0.002
    low = body.rest.min(0) - 3 * spacing
    shape = np.ceil((body.rest.max(0) + 3 * spacing - low) / spacing).astype(int) + 1
    nodes = low + spacing * np.stack(np.meshgrid(*[np.arange(n) for n in shape], indexing="ij"), -1).reshape(-1, 3)
    count = world.camera.frames
    moved = np.stack([world.field(nodes, t, 0.9) for t in range(count)])
    position = np.stack([body.rest + world.field(body.rest, t, 0.9) for t in range(count)])
    speed = np.gradient(world.amount)
    return Replay(
        time=np.arange(count) / world.camera.fps,
        position=position.astype(np.float32),
        nodes=moved.astype(np.float32),
        origin=low.astype(float),
        shape=shape,
        spacing=spacing,
        smallest_volume_ratio=1 - 0.5 * np.abs(world.amount),
        energy=np.stack([1e-6 * speed**2, 2e-5 * world.amount**2], -1),
        rgb=rgb,
    )


def _deformation(world: World) -> Deformation:
    i = np.linspace(0, 5000, 60)
    quality = 34 - 16 * np.exp(-i / 700)
    phase = np.digitize(i, [2500, 3500, 4500])
    loss = 0.2 * np.exp(-i / 700) + 0.01
    history = np.stack([i, loss, quality, 900 + i / 10, phase], -1).astype(np.float32)
    sizes, duration = np.array([[3, 3, 2, 3]]), world.camera.frames / world.camera.fps
    field = still_field(np.array([-0.1, -0.1, 0.01, 0.0]), np.array([0.1, 0.1, 0.2, duration]), sizes, 2, 4, world.rng)
    return save_field(field, np.zeros(1), np.zeros((1, 2, 3)), history)


def _physics() -> Physics:
    terms = {
        "corotated": {
            "E": {"value": 3100.0, "unit": "Pa", "low": 900.0, "high": 9000.0, "identifiable": False},
            "nu": {"value": 0.42, "unit": "1", "low": 0.40, "high": 0.44, "identifiable": True},
        },
        "newtonian": {"eta": {"value": 12.0, "unit": "Pa s", "low": 10.0, "high": 15.0, "identifiable": True}},
    }
    return Physics(terms, 1000.0, [0.0, 0.0, 0.0], {"spacing": 0.002, "step": 2e-4})


def _fit() -> Fit:
    history = [
        {"round": r, "last_frame": 12 * (r + 1), "iteration": k, "cost": 400.0 * (r + 1) / (k + 1) ** 2 + 20}
        | {"corotated.E": 3000.0 * (1 + 0.02 * k), "newtonian.eta": 4.0 + 8 * (r + k / 3) / 3}
        for r in range(3)
        for k in range(4)
    ]
    history += [
        {"round": "field", "iteration": k, "track": 1.4 / (k + 1) + 0.4, "image": 0.1, "judged": 1.2 / (k + 1) + 0.6}
        for k in range(6)
    ]
    shares = {"rest": 0.0, "load": 0.24, "hold": 0.11, "release": 0.65}
    told = {"unit": "s", "value": 0.0039, "low": 0.003, "high": 0.005, "told": True, "phases": shares}
    untold = {"unit": "Pa", "value": 3100.0, "low": 900.0, "high": 9000.0, "told": False, "phases": shares}
    held_out = {"unit": "m", "default": 0.00093, "fitted": 0.00042, "after_release_fitted": None, "frames": [1, 9]}
    words = "The clip tells how fast the tissue comes back, not how stiff it is."
    return Fit(history, {"newtonian.eta / corotated.E": told, "corotated.E": untold}, held_out, words)
