"""Invent a clip: move the tissue, photograph it, and write down what only the inventor knows."""

import json

import numpy as np

from surgisim.artifacts.truth import Truth
from surgisim.config.phantom import Phantom
from surgisim.phantom import instrument, shading
from surgisim.phantom.block import Block, mesh
from surgisim.phantom.case import Case, generator, invent
from surgisim.phantom.elements import elements
from surgisim.phantom.march import Drive, march
from surgisim.phantom.points import choose, follow
from surgisim.phantom.smoke import smoke
from surgisim.phantom.texture import paint
from surgisim.phantom.view import look

BITE = 6e-4
"""How far above the tissue at rest the axis of the closed jaws' tips lies [m]."""
RETREAT = 0.030
"""How far the tool draws back after release [m]."""


def film(settings: Phantom, progress=None) -> tuple[np.ndarray, Truth]:
    """Frames, (T, H, W, 3) uint8 sRGB, and their truth."""
    case = invent(settings)
    block = mesh(case.shape, case.grip, settings.spacing, hold_sides=settings.sides == "held")
    times = np.arange(round(settings.duration * settings.fps)) / settings.fps
    positions = move(case, block, times, progress)
    return photograph(settings, case, block, times, positions, progress)


def move(case: Case, block: Block, times: np.ndarray, progress=None) -> np.ndarray:
    """Node positions at `times` [s], camera frame [m], (T, N, 3)."""
    drive = Drive(lambda t: case.timeline.carried(t)[:, None] * case.pull, case.timeline.grasp, case.timeline.release)
    return march(block, elements(block.points, block.cells, case.law), drive, times, progress)


def photograph(settings, case, block, times, positions, progress=None) -> tuple[np.ndarray, Truth]:
    """Ray-cast every frame, and record tool, depth and points."""
    view, s = case.view, settings.samples
    texture = paint(case.shape, generator(settings.seed, "texture"))
    texture.layers[..., 5] *= settings.wet
    through = smoke((view.height * s, view.width * s), settings.smoke, generator(settings.seed, "smoke"))
    rays, centres = view.rays(view.grid(s)), view.rays(view.grid(1)).reshape(-1, 3)
    sensor = generator(settings.seed, "sensor")
    frames = np.empty((len(times), view.height, view.width, 3), np.uint8)
    tool = np.zeros(frames.shape[:3], bool)
    depth = np.empty(frames.shape[:3], np.float32)
    cones = [tool_at(case, t) for t in times]
    for t in range(len(times)):
        hits = look(view, positions[t], block.triangles, s)
        light = shading.tissue(hits, rays, positions[t], block, case.shape, texture, case.lamp)
        z, normal, part, station = instrument.cast(cones[t], rays.reshape(-1, 3))
        front = z < hits.z.ravel()
        light.reshape(-1, 3)[front] = shading.steel(
            rays.reshape(-1, 3)[front], z[front], normal[front], part[front], station[front], case.lamp
        )
        light = through(light, times[t]) if settings.smoke else light
        frames[t] = shading.expose(light, s, case.lamp, settings.noise, sensor)
        depth[t] = look(view, positions[t], block.triangles, 1).z
        tool[t] = front.reshape(view.height, s, view.width, s).any((1, 3))
        tool[t] |= (instrument.cast(cones[t], centres)[0] < depth[t].ravel()).reshape(tool[t].shape)
        if progress:
            progress(t + 1, len(times), "photographing it")
    marks = choose(view, block, positions[0], tool[0], settings.points, generator(settings.seed, "points"))
    xyz, visible = follow(view, block, positions, depth, cones, marks)
    held = (times >= case.timeline.grasp - 1e-9) & (times <= case.timeline.release + 1e-9)
    center = case.shape.upper(case.grip.uv)
    truth = Truth(
        tool=tool,
        depth=depth,
        pixels=view.project(xyz[:, 0]).astype(np.float32),
        xyz=xyz.astype(np.float32),
        visible=visible,
        center_rest=center[None],
        radius=np.array([case.grip.radius]),
        position=(center + case.timeline.carried(times)[:, None] * case.pull)[None],
        active=held[None],
        parameters=json.dumps(parameters(settings, case), sort_keys=True),
    )
    return frames, truth


def tool_at(case: Case, t: float) -> np.ndarray:
    """The instrument's cones at time t [s]."""
    tip = case.shape.upper(case.grip.uv) + float(case.timeline.carried(t)) * case.pull
    along = tip - case.tool.port
    along /= np.linalg.norm(along)
    depth = case.shape.axes[2]
    ahead = along - (along @ depth) * depth
    tip = tip + 0.4 * case.grip.radius * ahead / np.linalg.norm(ahead) - BITE * depth
    back = case.timeline.retreat(t) * RETREAT * along
    return instrument.pose(case.tool, tip - back, 0.10 + 0.65 * case.timeline.gape(t))


def parameters(settings: Phantom, case: Case) -> dict:
    """What a scorer compares with, SI units."""
    view, law = case.view, case.law
    (cx, cy), line = view.center, case.timeline
    return {
        "neo_hookean": {"E": law.E, "nu": law.nu},
        "newtonian": {"eta": law.eta},
        "density": law.density,
        "thickness": case.shape.thickness,
        "sides": settings.sides,
        "hidden": [],
        "pull": case.pull.tolist(),
        "timeline": {"grasp": line.grasp, "pull": line.pull, "hold": line.hold, "release": line.release},
        "camera": {
            "width": view.width,
            "height": view.height,
            "fps": settings.fps,
            "fx": view.focal,
            "fy": view.focal,
            "cx": cx,
            "cy": cy,
        },
    }
